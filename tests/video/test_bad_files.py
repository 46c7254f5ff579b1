"""Files that cannot be used: one line that names the camera and the file."""

import wave
from fractions import Fraction

import pytest

from airborne.errors import VideoError
from airborne.video import VideoSource, open_recording
from tests.support.clips import numbered, plain_rig, write_clip


@pytest.fixture
def clip(tmp_path):
    return write_clip(tmp_path / "good.mp4", numbered(20), codec="libx264", pix_fmt="yuv420p")


def refusal(path, **options) -> str:
    with pytest.raises(VideoError) as caught:
        open_recording([VideoSource("cam1", path)], plain_rig("cam1"), **options)
    message = str(caught.value)
    assert "\n" not in message
    assert "cam1" in message or options
    return message


def test_a_missing_file_is_named(tmp_path):
    assert "nothing.mp4 not found" in refusal(tmp_path / "nothing.mp4")


def test_a_folder_is_no_video(tmp_path):
    assert "is not a file; give a video, or read pipes" in refusal(tmp_path)


def test_an_empty_file_is_called_empty(tmp_path):
    (tmp_path / "a.mp4").touch()
    assert "a.mp4 is empty" in refusal(tmp_path / "a.mp4")


def test_a_text_file_is_no_video(tmp_path):
    (tmp_path / "a.mp4").write_text("a video\n" * 200)
    assert "a.mp4 cannot be opened as a video" in refusal(tmp_path / "a.mp4")


def test_a_file_without_its_index_cannot_be_opened(clip, tmp_path):
    (tmp_path / "a.mp4").write_bytes(clip.read_bytes()[:200])
    message = refusal(tmp_path / "a.mp4")
    assert "a.mp4 cannot be opened as a video" in message or "a.mp4 holds no video stream" in message


def test_a_file_cut_off_before_its_first_image_is_refused(clip, tmp_path):
    data = clip.read_bytes()
    (tmp_path / "a.mp4").write_bytes(data[: data.index(b"mdat") + 40])
    assert "no image" in refusal(tmp_path / "a.mp4")


def test_a_sound_file_has_no_video_stream(tmp_path):
    with wave.open(str(tmp_path / "a.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 800, "NONE", "not compressed"))
        sound.writeframes(bytes(1600))
    assert "a.wav holds no video stream" in refusal(tmp_path / "a.wav")


def test_a_size_that_was_not_calibrated_is_refused_with_both_sizes(clip):
    with pytest.raises(VideoError, match=r"cam1: .*good.mp4 is 64×48 px, .* camera is 80×60 px"):
        open_recording([VideoSource("cam1", clip)], plain_rig("cam1", size=(80, 60)))


@pytest.mark.parametrize("names", [["cam1"], ["cam1", "cam3"], ["cam1", "cam2", "cam3"], ["cam1", "cam1"], []])
def test_each_camera_of_the_rig_needs_one_video(clip, names):
    with pytest.raises(VideoError, match=r"the calibration has cam1, cam2"):
        open_recording([VideoSource(name, clip) for name in names], plain_rig("cam1", "cam2"))


def test_unknown_fields_are_refused(clip):
    with pytest.raises(VideoError, match="cam1: fields = 'upper' is unknown; use one of: progressive"):
        VideoSource("cam1", clip, "upper")


@pytest.mark.parametrize("options", [{"every": 0}, {"start": -1}, {"start": 5, "stop": 5}, {"fields_as": "frames"}])
def test_impossible_ways_of_reading_are_refused(clip, options):
    assert "use one of" in (message := refusal(clip, **options)) or "expected every >= 1" in message


def test_fields_of_a_rotated_video_are_refused(tmp_path):
    path = write_clip(
        tmp_path / "a.mp4",
        numbered(3),
        rate=Fraction(25),
        codec="libx264",
        pix_fmt="yuv420p",
        rotation_deg=90,
    )
    with pytest.raises(VideoError, match="both interlaced and rotated"):
        open_recording([VideoSource("cam1", path, "top-first")], plain_rig("cam1", size=(48, 64)))
