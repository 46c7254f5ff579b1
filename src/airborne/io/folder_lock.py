"""One writer a folder: a lock that a process holds and that is gone with it, however it ends."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from airborne.errors import ResultError

try:
    import fcntl
except ImportError:  # Windows: nothing is locked there
    fcntl = None

LOCK = "run.lock"  # without a process that holds it, the file means nothing


@contextmanager
def sole_writer(folder: Path) -> Iterator[None]:
    """Make a folder and be the only one that writes into it; raises ResultError where another process does."""
    folder.mkdir(parents=True, exist_ok=True)
    file = _lock(folder)
    try:
        os.ftruncate(file, 0)
        os.write(file, f"process {os.getpid()} on {socket.gethostname()} since {datetime.now():%F %T}".encode())
        yield
    finally:
        (folder / LOCK).unlink(missing_ok=True)
        os.close(file)


def _lock(folder: Path) -> int:
    """Return the locked file, open; one that its last holder has just removed is made anew."""
    path = folder / LOCK
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0))
        try:
            if fcntl is not None:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(file), path.stat()):
                return file
        except FileNotFoundError:
            pass
        except BlockingIOError:
            holder = os.read(file, 200).decode(errors="replace")
            os.close(file)
            raise _refusal(folder, holder) from None
        os.close(file)


def _refusal(folder: Path, holder: str) -> ResultError:
    elsewhere = "" if f" on {socket.gethostname()} " in holder else f"; if that machine is down, remove {LOCK}"
    return ResultError(
        f"{folder} is being written by another run ({holder or 'just started'}); wait for its end or stop it, "
        f"or give another folder{elsewhere if holder else ''}"
    )


def refuse_links(folder: Path) -> None:
    """Raise ResultError where something in a folder is a link that leads out of it: writing would follow it."""
    inside = folder.resolve()
    for path in folder.rglob("*"):
        if path.is_symlink() and not path.resolve().is_relative_to(inside):
            raise ResultError(
                f"{path} is a link that leads out of {folder}; remove it, as nothing is written through it"
            )
