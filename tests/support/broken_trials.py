"""Twenty ways in which a trial of a season can be broken, each on a copy of a good one."""

import re
import shutil
from pathlib import Path


def _text(pattern, replacement):
    """Replace in trial.toml."""

    def change(folder: Path):
        path = folder / "trial.toml"
        text, n = re.subn(pattern, replacement, path.read_text(), count=1, flags=re.MULTILINE)
        assert n == 1, pattern
        path.write_text(text)

    return change


def _file(name, data=None):
    """Write a file's bytes anew, or remove it."""

    def change(folder: Path):
        (folder / name).unlink()
        if data is not None:
            (folder / name).write_bytes(data)

    return change


def _swap_videos(folder: Path):
    (folder / "cam1.mp4").rename(folder / "was1.mp4")
    (folder / "cam2.mp4").rename(folder / "cam1.mp4")
    (folder / "was1.mp4").rename(folder / "cam2.mp4")


def _same_video(folder: Path):
    shutil.copy(folder / "cam1.mp4", folder / "cam2.mp4")


def _cut_video(folder: Path):
    path = folder / "cam1.mp4"
    path.write_bytes(path.read_bytes()[:200])


WAYS = {
    "no TOML": _text(r"\A", "name = = ="),
    "unknown key": _text(r"^\[track\]", "[track]\nfastest = true"),
    "video missing": _file("cam2.mp4"),
    "video empty": _file("cam1.mp4", b""),
    "video is text": _file("cam3.mp4", b"no video\n" * 100),
    "video cut off": _cut_video,
    "videos exchanged": _swap_videos,
    "video twice": _same_video,
    "calibration missing": _file("calib_true.toml"),
    "calibration is text": _file("calib_true.toml", b"hello"),
    "camera not calibrated": _text('name = "cam3"', 'name = "roof"'),
    "camera twice": _text('name = "cam2"', 'name = "cam1"'),
    "body missing": _file("cross.toml"),
    "body without parts": _file("cross.toml", b'name = "nothing"\n'),
    "start far away": _text(r"^position_m = .*", "position_m = [90.0, 0.0, 1.0]"),
    "start is no rotation": _text(r"^rotation_matrix = .*", "rotation_matrix = [[1, 0, 0], [1, 0, 0], [1, 0, 0]]"),
    "start past the end": _text(r"^frame = 0", "frame = 900"),
    "method unknown": _text('method = "refined"', 'method = "magic"'),
    "stops before it starts": _text(r"^stop = .*", "stop = 0"),
    "session missing": _text(r"\A", 'session = "nowhere.toml"\n'),
}
