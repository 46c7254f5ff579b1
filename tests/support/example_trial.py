"""Copies of the bundled example that are quick to read, and changed copies of its trial file."""

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

import av
import pytest

from tests.support.clips import write_clip
from tests.support.places import THROWN_CROSS

SHORT = 3  # fields that are tracked where the length does not matter
LONG = 12
CALIBRATED = 'file = "calib_true.toml"'
RATE = 25  # whole frames of the example [1/s]
QUICK = {"preset": "ultrafast", "crf": "23", "threads": "1", "x264-params": "tff=1"}  # grey values 2 off, of 255


def edit_trial(path: Path, name: str, *replacements: tuple[str, str]) -> Path:
    """Write a changed copy of a text file beside it."""
    text = path.read_text(encoding="utf-8")
    for old, new in replacements:
        assert old in text, f"{path.name} holds no {old!r}"
        text = text.replace(old, new, 1)
    path.with_name(name).write_text(text, encoding="utf-8")
    return path.with_name(name)


@cache
def light_cross() -> Path:
    """Return a copy of the example, which nobody changes: its videos are decoded in a seventh of the time."""
    parent = tempfile.mkdtemp(prefix="examples-")
    atexit.register(shutil.rmtree, parent, ignore_errors=True)
    folder = Path(parent) / THROWN_CROSS.name
    folder.mkdir()
    for path in THROWN_CROSS.iterdir():
        if path.suffix != ".mp4":
            shutil.copyfile(path, folder / path.name)
            continue
        with av.open(path) as video:
            frames = [_free(frame) for frame in video.decode(video=0)]
        coded = {"codec": "libx264", "pix_fmt": "yuv422p", "options": QUICK}
        write_clip(folder / path.name, frames, rate=RATE, **coded, index_first=False)
    return folder


def _free(frame: av.VideoFrame) -> av.VideoFrame:
    """Let the encoder choose what kind of picture a decoded one becomes."""
    frame.pict_type = av.video.frame.PictureType.NONE
    return frame


def bundle_light_cross(patch: pytest.MonkeyPatch) -> None:
    """Let `example_trial` find the light example in the place of the bundled one."""
    patch.setattr("airborne.trial.examples._FOLDERS", (light_cross().parent,))


def copy_cross(folder: Path, *, is_light: bool = True) -> Path:
    """Copy the example with its exact cameras, which saves whoever opens it their fit, and return the folder.

    In the light one a body is found as well, but grey values are smoother over time than its tracker expects.
    """
    shutil.copytree(light_cross() if is_light else THROWN_CROSS, folder, dirs_exist_ok=True)
    edit_trial(folder / "trial.toml", "trial.toml", ('control_points = "control_points.csv"', CALIBRATED))
    return folder
