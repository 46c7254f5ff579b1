"""Changed copies of the bundled example's trial file."""

import shutil
from pathlib import Path

from tests.support.places import THROWN_CROSS

SHORT = 3  # fields that are tracked where the length does not matter
LONG = 12
CALIBRATED = 'file = "calib_true.toml"'


def edit_trial(path: Path, name: str, *replacements: tuple[str, str]) -> Path:
    """Write a changed copy of a text file beside it."""
    text = path.read_text(encoding="utf-8")
    for old, new in replacements:
        assert old in text, f"{path.name} holds no {old!r}"
        text = text.replace(old, new, 1)
    path.with_name(name).write_text(text, encoding="utf-8")
    return path.with_name(name)


def copy_cross(folder: Path) -> Path:
    """Copy the example with its exact cameras, which saves whoever opens it their fit, and return the folder."""
    shutil.copytree(THROWN_CROSS, folder)
    edit_trial(folder / "trial.toml", "trial.toml", ('control_points = "control_points.csv"', CALIBRATED))
    return folder
