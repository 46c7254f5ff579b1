"""Files written, whole or not at all: where a disk is full, the error names the file and how much is free."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from airborne.errors import ResultError

_FULL = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC))


@contextmanager
def explain_full_disk(path: Path) -> Iterator[None]:
    """Raise ResultError, in one line, where what is done here finds no room for a file; other errors pass."""
    try:
        yield
    except OSError as error:
        if error.errno not in _FULL:
            raise
        free_mb = shutil.disk_usage(path if path.is_dir() else path.parent).free / 1e6
        raise ResultError(
            f"{path} cannot be written ({error.strerror}): {free_mb:.0f} MB are free on its disk, or less by quota; "
            "make room and give the command again (track: with --resume)"
        ) from error


def missing_folder(path: Path) -> str:
    """Return the sentence that says that a path's folder is not there."""
    return f"{path}: there is no folder {path.parent}; make it, or give another path"


def describe_path_error(error: OSError, elsewhere: str = "give another folder") -> str:
    """Describe what is wrong with the path of a file error; `elsewhere` is what to do where a folder is closed."""
    path = Path(str(error.filename or "a file"))
    if error.errno == errno.ENAMETOOLONG:
        return f"{str(path)[:60]}...: the name is too long; give a shorter one"
    file = next((each for each in (path, *path.parents) if each.is_file()), path)
    match error:
        case FileExistsError() | NotADirectoryError():
            return f"{file} is a file; give a folder"
        case IsADirectoryError():
            return f"{path} is a folder; give a file's name"
        case FileNotFoundError() if not path.parent.exists():
            return missing_folder(path)
        case PermissionError() if path.suffix == ".part" or not path.exists():  # .part: a file that is being written
            return f"{path.parent} cannot be written ({error.strerror}); {elsewhere}"
    return f"{path}: {error.strerror or error}; give a path that can be read or written"


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    with explain_full_disk(path):
        path.write_text(text, encoding="utf-8", newline="\n")


def replace_text(path: Path, text: str, *, is_durable: bool = True) -> None:
    """Write a text file whole or not at all, and through no link; it survives a power cut unless not `is_durable`."""
    part = path.with_name(f"{path.name}.part")
    with explain_full_disk(path):
        part.unlink(missing_ok=True)  # a killed writer's, or a link that leads elsewhere
        try:
            with part.open("x", encoding="utf-8", newline="\n") as file:
                file.write(text)
                if is_durable:
                    file.flush()
                    os.fsync(file.fileno())
            part.replace(path)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
