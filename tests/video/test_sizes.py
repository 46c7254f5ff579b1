"""A video of another size than its calibration is refused, and the mend is the one that fits the two sizes."""

from dataclasses import replace

import pytest

from airborne.cameras import Rig
from airborne.errors import VideoError
from airborne.video.decoding import VideoSource
from airborne.video.sizes import check_sizes
from tests.support.scenes import CAMERAS


@pytest.mark.parametrize(
    ("factor", "mend"),
    [
        ((0.5, 0.5), "saved_scale = 2 and saved_offset_px = [0.5, 0.5]"),
        ((1.5, 1.5), "saved_scale = 0.666667 and saved_offset_px = [-0.166667, -0.166667]"),
        ((0.75, 0.5), "saved_offset_px, where its first"),
        ((0.75, 0.5), "if it was resized too, saved_scale as well"),
        ((1.25, 0.5), None),
    ],
)
def test_mend_of_a_size(factor, mend):
    camera = CAMERAS[0]
    size = tuple(round(f * length) for f, length in zip(factor, camera.size, strict=True))
    with pytest.raises(VideoError, match="give the video that was calibrated") as error:
        check_sizes([VideoSource(camera.name, "a.mp4")], Rig((camera,)), [size])
    assert "\n" not in str(error.value)
    assert mend in str(error.value) if mend else "saved_" not in str(error.value)


def test_a_video_on_its_side_is_said_to_be_turned():
    camera = replace(CAMERAS[0], size=(768, 576))
    with pytest.raises(VideoError, match=r"576×768 px, but .* turned by 90 degrees, .* take the flag out$"):
        check_sizes([VideoSource(camera.name, "a.mp4")], Rig((camera,)), [(576, 768)])


def test_every_camera_of_another_size_is_named_in_one_line():
    cameras = [replace(CAMERAS[0], name=name) for name in ("a", "b", "c")]
    sizes = [(8, 8), cameras[1].size, (8, 8)]
    with pytest.raises(VideoError, match=r"^a: a\.mp4 is 8×8 px, .* px \(c differs too\); give the video"):
        check_sizes([VideoSource(each.name, "a.mp4") for each in cameras], Rig(tuple(cameras)), sizes)


def test_the_calibrated_size_passes():
    camera = CAMERAS[0]
    check_sizes([VideoSource(camera.name, "a.mp4")], Rig((camera,)), [camera.size])
