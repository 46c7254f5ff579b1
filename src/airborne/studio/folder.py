"""What the studio may read: the files of the opened folder, and none to which a link or `..` leads out of it."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from airborne.errors import AirborneError, TrialError

_T = TypeVar("_T")


def is_inside(folder: Path, path: Path) -> bool:
    """Say whether a path lies in a folder once all links are followed."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a name that is none, or links in a circle
        return False


def require_writable(folder: Path) -> None:
    """Raise TrialError for a folder in which nothing may be written: the studio keeps all that it does there."""
    if folder.is_dir() and not os.access(folder, os.W_OK):
        raise TrialError(
            f"{folder} may not be written, and the studio writes what you do into it; copy the folder to where you "
            "may write, or get the right to write here"
        )


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file that something in the folder names; raises TrialError for one outside of it."""
    path = folder / name
    if not is_inside(folder, path):
        raise TrialError(f"{name} lies outside {folder}, where nothing is read; put the file itself into the folder")
    return path


def files_inside(folder: Path, *endings: str) -> list[Path]:
    """List the files of a folder that have one of these endings, without links that lead out of it."""
    return [path for path in _files(folder, endings) if is_inside(folder, path)]


def outer_files(folder: Path, *endings: str) -> list[str]:
    """List the links to files elsewhere that have one of these endings; they are not read."""
    return [path.name for path in _files(folder, endings) if not is_inside(folder, path)]


def _files(folder: Path, endings: tuple[str, ...]) -> list[Path]:
    paths = folder.iterdir() if folder.is_dir() else ()
    return sorted(path for path in paths if path.name.lower().endswith(endings) and path.is_file())


def readable_files(folder: Path, read: Callable[[Path], _T], *endings: str) -> dict[str, _T]:
    """Return what a reader makes of those files of a folder that it can read, by name."""
    found = {}
    for path in files_inside(folder, *endings):
        with suppress(AirborneError, OSError, ValueError):
            found[path.name] = read(path)
    return found


def outer_links(folder: Path, inner: Path) -> list[str]:
    """List the links anywhere in a folder that is in the opened one which lead out of that; relative to it."""
    names = (os.path.join(place, name) for place, *within in os.walk(inner) for some in within for name in some)
    links = [Path(name) for name in names if os.path.islink(name)]  # looked for at each picture of a run
    return sorted(str(path.relative_to(folder)) for path in links if not is_inside(folder, path))


def file_stamp(path: Path) -> tuple[str, int, int]:
    """Return what changes whenever a file does: its name, its time of change [ns], its size; zeros where it is not."""
    try:
        status = path.stat()
    except OSError:
        return path.name, 0, 0
    return path.name, status.st_mtime_ns, status.st_size
