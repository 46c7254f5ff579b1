"""Commands of the command line that the studio starts: each in a process of its own, which can be stopped."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import count
from pathlib import Path

from airborne.studio.writing import FOLDER

_RUN = (
    "import sys; sys.argv[0] = 'airborne'; from airborne.io import terminal; terminal.seconds_a_line = 0.5; "
    "from airborne.cli import main; main()"
)
_numbers = count(1)  # of the commands: two exports may run at once
_PATIENCE_S = 10.0  # for a process that was told to stop


class Command:
    """One command, running or ended."""

    def __init__(self, words: Sequence[str], folder: Path) -> None:
        """Start `airborne` with these words in a folder."""
        self.words = tuple(words)
        self.started_s, self._began_s = time.monotonic(), time.time()
        self._out: bytes = b""
        self.is_told = False  # a page has shown what came of it
        self._log = folder / FOLDER / f"{words[0]}_{next(_numbers)}.log"
        self._log.parent.mkdir(exist_ok=True)
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _RUN, *words],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
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
        return self.progress() or f"it ended with the code {self.code}"

    def progress(self) -> str:
        """Return the last line of what it says beside its output."""
        return self._log.read_text(errors="replace").strip().rpartition("\n")[2].removeprefix("airborne: ")

    def how_far(self) -> str:
        """Return the last line of what it says beside its output; of one that counts, the numbers."""
        return re.sub(r"^.*: (?=\d+ of \w+$)", "", self.progress())

    def counted(self) -> int:
        """Return how many frames, or whatever it counts, it said last that it has done; 0 before it said so."""
        found = re.search(r"(\d+) of \d+$", self.progress())
        return int(found[1]) if found else 0

    def has_written(self, path: Path) -> bool:
        """Say whether a file has changed since it began."""
        return path.is_file() and path.stat().st_mtime >= self._began_s

    def stop(self) -> None:
        """Stop it as Ctrl-C does, and wait for its end."""
        if self.is_running:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
