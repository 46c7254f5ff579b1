"""Of the two orders of fields, the right one shows small teeth."""

from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.studio import field_order
from airborne.studio.field_order import order_jpeg, weave_orders
from airborne.video import VideoWriter, weave
from airborne.video.containers import open_file
from tests.support.clips import numbered, write_clip

SIZE = (320, 240)


def teeth(image):
    """How far neighbouring rows differ."""
    return float(np.abs(np.diff(image.astype(float), axis=0)).mean())


@pytest.mark.parametrize(("fields", "wrong"), [("top-first", "bottom-first"), ("bottom-first", "top-first")])
def test_the_right_order_has_smaller_teeth(tmp_path, fields, wrong):
    moments = np.full((60, SIZE[1], SIZE[0], 3), 60, np.uint8)
    for k, image in enumerate(moments):
        image[80:160, 20 + 4 * k : 60 + 4 * k] = 220
    with VideoWriter(tmp_path / "a.mp4", size=SIZE, rate=Fraction(25), fields=fields, crf=10) as writer:
        for first, second in zip(moments[::2], moments[1::2], strict=True):
            top, bottom = (first, second) if fields == "top-first" else (second, first)
            writer.write(weave(top[::2], bottom[1::2]))
    found = weave_orders(tmp_path / "a.mp4")
    assert found[fields].shape == (160, 240, 3)
    assert teeth(found[wrong]) > 2 * teeth(found[fields])


def test_both_orders_take_one_decoding_until_the_file_is_another(tmp_path, monkeypatch):
    decoded = []
    monkeypatch.setattr(field_order, "open_file", lambda *given: decoded.append(given) or open_file(*given))
    path = write_clip(tmp_path / "a.mkv", numbered(12))
    with ThreadPoolExecutor(2) as readers:
        jpegs = list(readers.map(lambda order: order_jpeg(path, order), field_order.ORDERS))
    assert len(decoded) == 1 and jpegs[0] != jpegs[1]
    write_clip(path, numbered(8))
    order_jpeg(path, "top-first")
    assert len(decoded) == 2


def test_a_single_picture_has_no_order(tmp_path):
    with pytest.raises(VideoError, match="fewer than two pictures"):
        weave_orders(write_clip(tmp_path / "a.mkv", numbered(1)))
