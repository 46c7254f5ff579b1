"""The folder of a new run: what it may be called, and the next free name beside a run that is kept."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from airborne.errors import TrialError
from airborne.io.names import check_name
from airborne.studio.folder import is_inside, outer_links


def check_run_name(folder: Path, name: str) -> Path:
    """Return the folder in which a run of this name lies, there or not. Raises TrialError where it cannot be one."""
    try:
        check_name(name)
    except ValueError:
        raise TrialError(
            f'"{name[:40]}" cannot be the folder of a run; give a name of 1 to 80 characters with no slash in it '
            "and no dot at its beginning, as results_2"
        ) from None
    path = folder / name
    if path.exists() and not path.is_dir():
        raise TrialError(
            f"{name} is a file of this folder; give the run another name, as {next_run_name(folder, 'results')}"
        )
    if not is_inside(folder, path):
        raise TrialError(f"{name} is a link that leads out of the folder; give another name")
    if links := outer_links(folder, path):
        raise TrialError(f"{', '.join(links)} leads out of the folder; remove the link, or give another name")
    return path


def next_run_name(folder: Path, name: str) -> str:
    """Return a free name for one more run: results, results_2, results_3."""
    stem, _, number = name.rpartition("_")
    stem, first = (stem, int(number)) if stem and number.isdecimal() else (name, 1)
    names = (stem if k == 1 else f"{stem}_{k}" for k in count(first))
    return next(each for each in names if not (folder / each).exists())
