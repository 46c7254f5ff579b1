"""A picture that repeats the one before is named with its frame, and a video of one picture as a still one."""

from contextlib import closing

import numpy as np
import pytest

from airborne.video import VideoSource, open_recording
from tests.support.clips import plain_rig, write_clip

N = 14


def moving(n=N, step_px=4):
    """A bright box before a dull picture, that moves to the right."""
    pictures = [np.full((48, 64, 3), 90, np.uint8) for _ in range(n)]
    for k, picture in enumerate(pictures):
        picture[10:30, step_px * k : step_px * k + 10] = 220
    return pictures


def events(folder, pictures, fields="progressive"):
    """Read a video of the second camera, beside one of the first in which all moves."""
    options = {"codec": "libx264", "pix_fmt": "yuv420p"}
    write_clip(folder / "a.mkv", moving(), **options)
    write_clip(folder / "b.mkv", pictures, **options)
    sources = [VideoSource(name, folder / f"{name}.mkv", fields) for name in ("a", "b")]
    recording = open_recording(sources, plain_rig("a", "b"))
    with closing(iter(recording)) as frames:
        assert sum(1 for _ in frames) >= N
    return [event for event in recording.events if "flags" not in event]


@pytest.mark.parametrize(("fields", "frame"), [("progressive", 6), ("top-first", 12)])
def test_a_repeated_picture_is_named_with_its_frame(tmp_path, fields, frame):
    pictures = moving()
    (said,) = events(tmp_path, [*pictures[:6], pictures[5], *pictures[6:-1]], fields)
    assert said.startswith(f"b: frame {frame} (0.120 s) repeats the picture before it")


@pytest.mark.parametrize("pictures", [moving(), [*moving()[:5], *[moving()[5]] * (N - 5)]])
def test_of_a_thing_that_moves_or_comes_to_rest_nothing_is_said(tmp_path, pictures):
    assert events(tmp_path, pictures) == []


def test_a_video_of_one_picture_is_named(tmp_path):
    (said,) = events(tmp_path, [moving()[3]] * N)
    assert said.startswith("b: its pictures are all the same")
