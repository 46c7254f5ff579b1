"""Curves that show an offset: on the trial's clock they rise together where it is right, and apart where it is not."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.studio.sync_evidence import curves_svg, level_curves
from airborne.video import VideoSource
from tests.support.clips import write_clip

RATE, FLASH, LATE = Fraction(50), 20, 10  # pictures


@pytest.mark.parametrize("offset_s", [0.0, -0.2])
def test_flashes_come_together_where_the_offset_is_right(tmp_path, offset_s):
    for name, first in (("a", FLASH), ("b", FLASH + LATE)):
        images = [np.full((48, 64, 3), 200 if first <= k < first + 5 else 40, np.uint8) for k in range(60)]
        write_clip(tmp_path / f"{name}.mp4", images, rate=RATE)
    sources = [VideoSource("a", tmp_path / "a.mp4"), VideoSource("b", tmp_path / "b.mp4", offset_s=offset_s)]
    curves = level_curves("flash", sources)
    rises = [curve[np.argmax(np.diff(curve[:, 1])) + 1, 0] for curve in curves]
    assert rises[1] - rises[0] == pytest.approx(LATE / RATE + offset_s, abs=1e-6)
    svg = curves_svg(curves, ["#000", "#fff"])
    assert svg.count("<polyline") == 2 and "nan" not in svg


def test_a_camera_without_pictures_there_has_an_empty_line():
    assert curves_svg([np.array([[0.0, 0.0], [1.0, 1.0]]), np.empty((0, 2))], ["#000", "#fff"]).count('points=""') == 1
