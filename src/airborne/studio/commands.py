"""Commands of the command line that the studio starts: each in a process of its own, which can be stopped."""

from __future__ import annotations

import io
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path

from airborne.io.folder_lock import LOCK, find_writer
from airborne.io.terminal import WATCHED
from airborne.motion.run_folder import SUMMARY
from airborne.studio.writing import FOLDER

_RUN = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"
_numbers = count(1)  # of the commands: two exports may run at once
_PATIENCE_S = 10.0  # for a process that was told to stop
_LONGEST_LINE = 4096  # bytes: of a run of hours there are many lines
_SOON_S = 0.05  # between looks whether it has


class Command:
    """One command, running or ended."""

    def __init__(self, words: Sequence[str], folder: Path, other: OtherProcess | None = None) -> None:
        """Start `airborne` with these words in a folder, or look at an `other` process that does what they say."""
        self.words = tuple(words)
        self.is_own = other is None  # it ends with the studio
        age_s = 0.0 if other is None else other.age_s
        self.started_s, self._began_s = time.monotonic() - age_s, time.time() - age_s
        self._out: bytes = b""
        self.is_told = False  # a page has shown what came of it
        self._log = folder / FOLDER / f"{words[0]}_{next(_numbers)}.log"
        self._log.parent.mkdir(exist_ok=True)
        with self._log.open("wb") as log:
            self._process = other or subprocess.Popen(
                [sys.executable, "-c", _RUN, *words],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                env=os.environ | {WATCHED: "yes"},
            )

    @property
    def is_running(self) -> bool:
        """Whether it goes on."""
        return self._process.poll() is None

    @property
    def code(self) -> int | None:
        """The exit code; None while it runs."""
        return self._process.poll()

    @property
    def seconds(self) -> float:
        """How long it has been running."""
        return time.monotonic() - self.started_s

    @property
    def line(self) -> str:
        """The command as one would type it."""
        return " ".join(["airborne", *self.words])

    def output(self) -> str:
        """Return what an ended command printed."""
        if self._process.stdout is not None and not self._process.stdout.closed:
            with self._process.stdout as stdout:
                self._out = stdout.read()
        return self._out.decode(errors="replace")

    def complaint(self) -> str:
        """Return the last line of an ended command's errors."""
        return self.progress() or "it ended early" + (f", with the code {self.code}" if self.is_own else "; go on")

    def progress(self) -> str:
        """Return the last line of what it says beside its output."""
        with self._log.open("rb") as log:
            log.seek(max(0, self._log.stat().st_size - _LONGEST_LINE))
            return log.read().decode(errors="replace").strip().rpartition("\n")[2].removeprefix("airborne: ")

    def how_far(self) -> str:
        """Return the last line of what it says beside its output; of one that counts, the numbers."""
        return re.sub(r"^.*: (?=\d+ of \w+$)", "", self.progress())

    def n_done(self) -> int:
        """Return how many frames it said last that it has tracked; 0 before it said so."""
        found = re.search(r"^tracking .*: (\d+) of \d+$", self.progress())
        return int(found[1]) if found else 0

    def has_written(self, path: Path) -> bool:
        """Say whether a file has changed since it began."""
        return path.is_file() and path.stat().st_mtime >= self._began_s

    def stop(self) -> None:
        """Stop it, as in order as by Ctrl-C, and wait for its end."""
        if self.is_running:
            self._process.terminate()  # Ctrl-C is not heard by what a shell's background started
            try:
                self._process.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()


class OtherProcess:
    """The process that writes a run and is not ours: a studio that was killed left it, or a terminal started it."""

    def __init__(self, run: Path, number: int) -> None:
        """Look at the process of a number for as long as it is the run's writer."""
        self._run, self._number = run, number
        self.stdout = io.BytesIO(b"ended\n")  # what it printed went elsewhere

    @property
    def age_s(self) -> float:
        """How long it has been writing."""
        return max(time.time() - (self._run / LOCK).stat().st_mtime, 0.0)

    def poll(self) -> int | None:
        """Return None while it goes on, then whether it ended early."""
        return None if find_writer(self._run) == self._number else int(not (self._run / SUMMARY).is_file())

    def terminate(self) -> None:
        """Tell it to end."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once."""
        self._send(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> None:
        """Wait for its end. Raises TimeoutExpired."""
        end_s = math.inf if timeout is None else time.monotonic() + timeout
        while self.poll() is None:
            if time.monotonic() > end_s:
                raise subprocess.TimeoutExpired(str(self._number), timeout or 0.0)
            time.sleep(_SOON_S)

    def _send(self, number: int) -> None:
        with suppress(ProcessLookupError):
            os.kill(self._number, number)


def find_tracking(folder: Path, trial: Path) -> Command | None:
    """Return the command that tracks into a run of the folder and is not ours, where one does."""
    for lock in sorted(folder.glob(f"*/{LOCK}")):
        run, number = lock.parent, find_writer(lock.parent)
        is_tracked = number != os.getpid() and not (run / SUMMARY).is_file()  # else what is finished is added to
        if number is not None and is_tracked and run.name != FOLDER and not run.is_symlink():
            with suppress(FileNotFoundError):  # it has just ended
                return Command(["track", trial.name, "-o", run.name], folder, OtherProcess(run, number))
    return None
