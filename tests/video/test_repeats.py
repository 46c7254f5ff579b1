"""A picture that repeats the one before is named with its frame, and a video of one picture as a still one."""

from contextlib import closing
from itertools import islice

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


def read(folder, pictures, fields="progressive", codec="libx264"):
    """Read a video of the second camera, beside one of the first in which all moves: its frames and what was said."""
    options = {"codec": codec, "pix_fmt": "yuv420p"}
    write_clip(folder / "a.mkv", moving(), **options)
    write_clip(folder / "b.mkv", pictures, **options)
    sources = [VideoSource(name, folder / f"{name}.mkv", fields) for name in ("a", "b")]
    recording = open_recording(sources, plain_rig("a", "b"))
    with closing(iter(recording)) as frames:
        seen = list(frames)
    assert len(seen) >= N
    return seen, [event for event in recording.events if "flags" not in event]


@pytest.mark.parametrize(
    ("fields", "frames"), [("progressive", "frame 6 repeats"), ("top-first", "frames 12 to 13 repeat")]
)
def test_a_repeated_picture_is_named_with_its_frame(tmp_path, fields, frames):
    pictures = moving()
    _, (said,) = read(tmp_path, [*pictures[:6], pictures[5], *pictures[6:-1]], fields)
    assert said.startswith(f"b: {frames} the picture before")


def test_repeated_pictures_are_no_images_of_their_camera(tmp_path):
    pictures = moving()
    repeated = [*pictures[:6], *[pictures[5]] * 3, *pictures[9:12], pictures[11], pictures[11]]
    seen, (said,) = read(tmp_path, repeated)
    assert said.startswith("b: frames 6 to 8, 12 to 13 repeat the picture before them and are left out")
    assert [k for k, frames in enumerate(seen) if frames.views[1] is None] == [6, 7, 8, 12, 13]
    assert all(frames.views[0] is not None for frames in seen)


def test_of_a_thing_that_moves_or_comes_to_rest_nothing_is_said(tmp_path):
    _, said = read(tmp_path, moving())
    edges = [20 + 8 * (1 - 0.7**k) for k in range(N)]  # of a bright half of the picture, that stops after 8 px
    shares = [np.clip(edge - np.arange(64) + 0.5, 0, 1) for edge in edges]
    at_rest = [np.tile((90 + 130 * share)[None, :, None], (48, 1, 3)).astype(np.uint8) for share in shares]
    _, said_at_rest = read(tmp_path, at_rest, codec="ffv1")  # which loses nothing
    assert (said, said_at_rest) == ([], [])


def test_a_reading_that_goes_on_from_between_two_fields_of_a_picture_sees_no_repeat(tmp_path):
    for name in "ab":
        write_clip(tmp_path / f"{name}.mkv", moving(), codec="libx264", pix_fmt="yuv420p")
    sources = [VideoSource(name, tmp_path / f"{name}.mkv", "top-first") for name in "ab"]
    recording = open_recording(sources, plain_rig("a", "b"))
    for n in (5, 8, 11, 2 * N):
        with closing(iter(recording)) as frames:
            seen = list(islice(frames, n))
        assert len(seen) == n
        assert all(view is not None for frames in seen for view in frames.views)


def test_a_key_frame_among_repeated_pictures_is_repeated_though_compressed_anew(tmp_path):
    faint = [np.where(picture > 90, 100, 90).astype(np.uint8) for picture in moving()]
    noise = np.random.default_rng(0).integers(-1, 2, (48, 64, 1), np.int8)
    anew = (faint[5] + 2 * noise).astype(np.uint8)
    seen, (said,) = read(tmp_path, [*faint[:6], faint[5], faint[5], anew, faint[5], *faint[10:]], codec="ffv1")
    assert said.startswith("b: frames 6 to 9 repeat")
    assert [k for k, frames in enumerate(seen) if frames.views[1] is None] == [6, 7, 8, 9]


def test_of_a_flash_a_cut_and_a_dark_picture_nothing_is_said(tmp_path):
    still, dark, bright = (np.full((48, 64, 3), level, np.uint8) for level in (90, 0, 250))
    _, said = read(tmp_path, [still, still, dark, dark, dark, still, still, bright, still, still, *moving()[:4]])
    assert said == []


def test_a_video_of_one_picture_is_named(tmp_path):
    _, (said,) = read(tmp_path, [moving()[3]] * N)
    assert said.startswith("b: its pictures are all the same")
