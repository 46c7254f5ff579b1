"""The newest JPEGs in a file without a name: it goes with the process, however that ends, and takes no memory."""

from __future__ import annotations

import tempfile
from collections import OrderedDict
from contextlib import suppress
from threading import Lock
from typing import NamedTuple
from weakref import finalize

from airborne.video import VideoSource


class Key(NamedTuple):
    """A picture of a video."""

    source: VideoSource
    number: int  # of its image
    shrink: int  # times smaller than the video


class _Part(NamedTuple):
    begin: int  # in the file [bytes]
    n_bytes: int
    is_damaged: bool  # there is no picture


class JpegStore:
    """As many JPEGs as fit into a file, which is written round and round; for any number of threads."""

    def __init__(self, most_bytes: int) -> None:
        """Open nothing yet."""
        self._most, self._end, self._lock = most_bytes, 0, Lock()
        self._parts: OrderedDict[Key, _Part] = OrderedDict()  # in the order of the file, from the oldest on
        self._file = None
        self.is_full = False  # whether one more takes the place of the oldest

    def __contains__(self, key: Key) -> bool:
        return key in self._parts

    def find(self, key: Key) -> tuple[bool, bytes | None]:
        """Return whether a picture is there, and the picture; None where it is damaged."""
        with self._lock:
            part = self._parts.get(key)
            if part is None or part.is_damaged or self._file is None:
                return part is not None, None
            self._file.seek(part.begin)
            return True, self._file.read(part.n_bytes)

    def add(self, key: Key, jpeg: bytes | None) -> None:
        """Keep a picture; on a full disk it is made anew when it is asked for."""
        data = jpeg or bytes(1)  # each has its own place
        with self._lock, suppress(OSError):
            self._parts.pop(key, None)
            if self._end + len(data) > self._most:
                self._forget(self._most)
                self._end, self.is_full = 0, True
            self._forget(self._end + len(data))
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115
                finalize(self, self._file.close)
            self._file.seek(self._end)
            if self._file.write(data) == len(data) <= self._most:
                self._parts[key] = _Part(self._end, len(data), jpeg is None)
                self._end += len(data)

    def _forget(self, end: int) -> None:
        """Forget what lies in the way between where was written last and an end."""
        while self._parts and self._end <= next(iter(self._parts.values())).begin < end:
            self._parts.popitem(last=False)
