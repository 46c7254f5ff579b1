"""Only the part of an image that somebody looks at is converted; it is the part of the whole image."""

from dataclasses import replace
from fractions import Fraction

import av
import numpy as np
import pytest
from av.video.reformatter import ColorRange

from airborne.cameras import Rig
from airborne.errors import VideoError
from airborne.video import VideoSource, open_recording
from airborne.video import lazy as lazy_frames
from airborne.video.crops import conversion_of, rgb_from_part
from airborne.video.pixels import frame_from_rgb, rgb_from_frame
from tests.support.clips import plain_camera, plain_rig, textured, write_clip

SIZE = (66, 50)
BARREL = (-0.25, 0.05, 0.002, -0.001, 0.0)
BOXES = [(0, 0, 66, 50), (13, 7, 38, 44), (14, 8, 15, 9), (65, 49, 66, 50), (0, 31, 1, 50), (33, 0, 66, 3)]


def noisy_frame(pix_fmt, *, short_side=1080, size=SIZE):
    return frame_from_rgb(textured(1, size)[0], short_side=short_side, pix_fmt=pix_fmt)


def lazy(path, rig, **kwargs):
    return open_recording([VideoSource("cam1", path)], rig, lazy=True, **kwargs)


@pytest.mark.parametrize("short_side", [576, 1080])
@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv422p", "yuvj420p", "yuvj422p"])
def test_a_part_is_the_part_of_the_whole_within_a_grey_level(pix_fmt, short_side):
    frame = noisy_frame(pix_fmt, short_side=short_side)
    frame.color_range = ColorRange.JPEG if pix_fmt.startswith("yuvj") else ColorRange.MPEG
    colours = conversion_of(frame, short_side=short_side)
    assert colours is not None
    whole = rgb_from_frame(frame, short_side=short_side).astype(int)
    for box in BOXES:
        x0, y0, x1, y1 = box
        part = rgb_from_part(frame, colours, box)
        assert part.shape == (y1 - y0, x1 - x0, 3)
        assert np.abs(part - whole[y0:y1, x0:x1]).max() <= 1, box


@pytest.mark.parametrize("pix_fmt", ["yuv444p", "yuv420p10le", "rgb24", "gray"])
def test_of_rare_formats_there_is_only_the_whole(pix_fmt):
    assert conversion_of(noisy_frame(pix_fmt), short_side=1080) is None


@pytest.mark.parametrize("location", ["left", "center", "topleft"])
def test_the_chroma_siting_is_detected(tmp_path, location):
    """x264 writes into the stream where its chroma lies, and the decoded frames carry it on."""
    places = {"left": "0", "center": "1", "topleft": "2"}
    frames = [noisy_frame("yuv420p", size=(64, 48))] * 3
    options = {"crf": "0", "x264-params": f"chromaloc={places[location]}"}
    path = write_clip(tmp_path / "cam1.mp4", frames, codec="libx264", pix_fmt="yuv420p", options=options)
    with av.open(str(path)) as video:
        frame = next(video.decode(video=0))
    colours = conversion_of(frame, short_side=48)
    assert colours is not None
    found = (colours.siting_x == (0, 2), colours.siting_y == (0, 2))
    assert found == {"left": (True, False), "center": (False, False), "topleft": (True, True)}[location]


@pytest.mark.parametrize("distortion", [(0, 0, 0, 0, 0), BARREL])
def test_a_lazy_recording_shows_what_the_eager_one_does(tmp_path, distortion):
    frames = [frame_from_rgb(image, short_side=50) for image in textured(3, SIZE)]
    path = write_clip(tmp_path / "cam1.mp4", frames, codec="libx264", pix_fmt="yuv420p", options={"crf": "0"})
    rig = Rig((plain_camera(size=SIZE, distortion=distortion),))
    eager = open_recording([VideoSource("cam1", path)], rig)
    for before, now in zip(eager, lazy(path, rig), strict=True):
        (expected,), (view,) = before.views, now.views
        assert (now.index, now.time_s) == (before.index, before.time_s)
        np.testing.assert_array_equal(view.camera.K, expected.camera.K)
        for x0, y0, x1, y1 in BOXES:
            part = view.crop((x0, y0, x1, y1)).astype(int)
            assert part.shape == (y1 - y0, x1 - x0, 3)
            assert np.abs(part - expected.rgb[y0:y1, x0:x1]).max() <= 1
        np.testing.assert_array_equal(view.rgb, expected.rgb)


def test_looking_at_a_part_converts_no_whole_image_and_the_whole_is_converted_once(tmp_path, monkeypatch):
    frames = [frame_from_rgb(image, short_side=50) for image in textured(1, SIZE)]
    path = write_clip(tmp_path / "cam1.mp4", frames, codec="libx264", pix_fmt="yuv420p")
    asked, whole_of = [], lazy_frames.rgb_from_decoded
    monkeypatch.setattr(lazy_frames, "rgb_from_decoded", lambda *given: asked.append(1) or whole_of(*given))
    ((view,),) = [frames.views for frames in lazy(path, plain_rig("cam1", size=SIZE))]
    view.crop((3, 3, 20, 20))
    assert asked == []
    assert view.rgb is view.rgb
    assert asked == [1]


@pytest.mark.parametrize("rotation_deg", [90, 180])
def test_rotated_images_are_cropped_by_way_of_the_whole(tmp_path, rotation_deg):
    path = write_clip(tmp_path / "cam1.mp4", textured(2), codec="libx264", pix_fmt="yuv420p", rotation_deg=rotation_deg)
    size = (48, 64) if rotation_deg == 90 else (64, 48)
    rig = plain_rig("cam1", size=size)
    for before, now in zip(open_recording([VideoSource("cam1", path)], rig), lazy(path, rig), strict=True):
        np.testing.assert_array_equal(now.views[0].crop((5, 3, 30, 31)), before.views[0].rgb[3:31, 5:30])


def test_fields_are_cropped_by_way_of_the_whole(thrown_cross):
    from airborne.cameras import read_rig

    rig = read_rig(thrown_cross / "calib_true.toml").select(["cam1"])
    source = VideoSource("cam1", thrown_cross / "cam1.mp4", "top-first")
    before, now = (next(iter(open_recording([source], rig, lazy=is_lazy))) for is_lazy in (False, True))
    np.testing.assert_array_equal(now.views[0].crop((100, 50, 300, 90)), before.views[0].rgb[50:90, 100:300])


def test_lazy_fields_cannot_be_interpolated(tmp_path):
    path = write_clip(tmp_path / "cam1.mkv", textured(1))
    with pytest.raises(VideoError, match='fields_as = "rows"'):
        lazy(path, plain_rig("cam1"), fields_as="interpolated")


def test_gaps_and_stop_are_those_of_the_eager_recording(tmp_path):
    path = write_clip(
        tmp_path / "cam1.mkv", textured(6), stamps=[0, 20, 40, 100, 120, 140], time_base=Fraction(1, 1000)
    )
    rig = plain_rig("cam1")
    seen = [(f.index, f.views[0] is None) for f in lazy(path, rig, start=1, stop=7)]
    assert seen == [
        (f.index, f.views[0] is None) for f in open_recording([VideoSource("cam1", path)], rig, start=1, stop=7)
    ]
    assert replace(lazy(path, rig), every=2).rate == 25
