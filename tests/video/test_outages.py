"""Outages of cameras are reported with their frames."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.video import Frames, Outages, View
from airborne.video.outages import DARK_LEVEL, N_LISTED, is_dark
from tests.support.clips import plain_camera


def view(level):
    camera = plain_camera()
    return View(camera, np.full((camera.size[1], camera.size[0], 3), level, np.uint8))


def outages_of(levels, step=1):
    """What is reported of a first camera that shows these levels (None: no image), beside an intact one."""
    outages = Outages(("left", "right"))
    for k, level in enumerate(levels):
        views = (None if level is None else view(level), view(90))
        outages.add(Frames(step * k, Fraction(k, 50), views))
    return list(outages.describe())


def test_nothing_is_reported_of_cameras_that_show_something():
    assert outages_of([90, 200, DARK_LEVEL]) == []


def test_missing_and_dark_images_are_reported_by_camera_and_frames():
    assert outages_of([90, None, None, 90, 3, 90, None]) == [
        "left: no image at 3 of 7 frames: frames 1 to 2, 6",
        "left: dark at 1 of 7 frames: frame 4",
    ]


def test_frames_that_are_left_out_on_purpose_make_no_new_stretch():
    assert outages_of([90, None, None, None], step=3) == ["left: no image at 3 of 4 frames: frames 3 to 9"]


def test_an_image_that_is_masked_is_no_outage():
    outages = Outages(("left",), {"left": ((1, 2),)})
    for k in range(4):
        outages.add(Frames(k, Fraction(k, 50), (None if k else view(90),)))
    assert list(outages.describe()) == ["left: no image at 1 of 4 frames: frame 3"]


@pytest.mark.parametrize("n", [40, 4000])
def test_the_report_does_not_grow_with_the_run(n):
    (line,) = outages_of([None if k % 2 else 90 for k in range(n)])
    assert line.startswith(f"left: no image at {n // 2} of {n} frames: frames 1, 3, 5, 7, 9 and")
    assert line.endswith(f"{n // 2 - N_LISTED} more times")


def test_a_dark_image_with_a_bright_corner_is_not_dark():
    shown = view(0)
    assert is_dark(shown)
    shown.rgb[-4:, -4:] = 200
    assert not is_dark(shown)


def test_frames_before_the_start_come_last_and_are_listed_upward():
    outages = Outages(("left",))
    for k in (4, 5, 3, 2, 1):
        outages.add(Frames(k, Fraction(k, 50), (view(90) if k == 4 else None,)))
    assert list(outages.describe()) == ["left: no image at 4 of 5 frames: frames 5, 1 to 3"]
