"""One writer a folder: a lock that a process holds and that is gone with it, however it ends."""

from __future__ import annotations

import os
import re
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from airborne.errors import ResultError
from airborne.io.text import read_text
from airborne.io.writing import explain_full_disk

try:
    import fcntl
except ImportError:  # Windows: nothing is locked there
    fcntl = None

_LONGEST_HOLDER = 200  # bytes of what a holder says of itself
LOCK = "run.lock"  # without a process that holds it, the file means nothing


class InUseError(ResultError):
    """Another process writes into the folder; `holder` says which."""

    def __init__(self, message: str, holder: str) -> None:
        """Keep the holder, as it described itself."""
        super().__init__(message)
        self.holder = holder


@contextmanager
def sole_writer(folder: Path, address: str = "") -> Iterator[None]:
    """Make a folder and be the only one that writes into it; raises InUseError where another process does.

    That one is told which process has it, since when, and the `address` where it is found. A folder
    that was not there and stays empty is removed again.
    """
    is_new = not folder.exists()
    file = _lock(folder)
    holder = f"process {os.getpid()} on {socket.gethostname()} since {datetime.now():%F %T}"
    try:
        with explain_full_disk(folder):  # of whatever is written meanwhile, also where a file is closed
            os.ftruncate(file, 0)
            os.write(file, f"{holder}, {address}".rstrip(", ").encode())
            yield
    finally:
        (folder / LOCK).unlink(missing_ok=True)
        os.close(file)
        if is_new:
            with suppress(OSError):  # something is in it
                folder.rmdir()


def find_writer(folder: Path) -> int | None:
    """Return the process of this user, on this computer, that is the folder's only writer; None where none is."""
    try:
        text = read_text(folder / LOCK, _LONGEST_HOLDER)
        found = re.match(rf"process (\d+) on {re.escape(socket.gethostname())} ", text)
        if found is None or fcntl is None:
            return None
        os.kill(process := int(found[1]), 0)  # raises where there is none
    except (OSError, ValueError, OverflowError):
        return None
    return None if _has_ended(process) else process


def _has_ended(process: int) -> bool:
    """Say whether a process has ended though it is still listed, as nobody has asked how: Linux tells."""
    try:
        return Path(f"/proc/{process}/stat").read_bytes().rpartition(b")")[2].split()[0] in (b"Z", b"X")
    except OSError:
        return False


def _lock(folder: Path) -> int:
    """Return the locked file, open, in a folder made if need be; what its last holder has just removed is made anew."""
    path = folder / LOCK
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except FileExistsError as error:
            if _is_no_folder(folder):
                what = "a broken link" if folder.is_symlink() else "a file"
                raise ResultError(f"{folder} is {what}; give a folder") from None
            if error.filename != str(folder):
                raise
            continue  # its last holder has removed the folder while it was looked at
        try:
            file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0))
        except FileNotFoundError:  # its last holder has just removed the folder
            continue
        try:
            if fcntl is not None:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(file), path.stat()):
                return file
        except FileNotFoundError:
            pass
        except BlockingIOError:
            holder = os.read(file, _LONGEST_HOLDER).decode(errors="replace")
            os.close(file)
            raise _refusal(folder, holder) from None
        os.close(file)


def _is_no_folder(path: Path) -> bool:
    """Say whether something is there that is neither a folder nor a link to one."""
    try:
        return not stat.S_ISDIR(path.lstat().st_mode) and not path.is_dir()
    except FileNotFoundError:
        return False


def _refusal(folder: Path, holder: str) -> InUseError:
    elsewhere = "" if f" on {socket.gethostname()} " in holder else f"; if that machine is down, remove {LOCK}"
    return InUseError(
        f"{folder} is being written by another run ({holder or 'just started'}); wait for its end or stop it, "
        f"or give another folder{elsewhere if holder else ''}",
        holder,
    )


def refuse_links(folder: Path) -> None:
    """Raise ResultError where something in a folder is a link that leads out of it: writing would follow it."""
    inside = folder.resolve()
    for path in folder.rglob("*"):
        if path.is_symlink() and not path.resolve().is_relative_to(inside):
            raise ResultError(
                f"{path} is a link that leads out of {folder}; remove it, as nothing is written through it"
            )
