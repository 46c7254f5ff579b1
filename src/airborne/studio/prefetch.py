"""Pictures made while nobody waits, so that a jump finds them: those around the last that were asked for come first."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import numpy as np

from airborne.errors import AirborneError
from airborne.studio.jpeg_store import JpegStore, Key
from airborne.types import Image
from airborne.video import VideoSource
from airborne.video.image_index import ImageIndex
from airborne.video.seeking import ImageReader

_QUIET_S = 0.15  # without a question: a browser that shows frames one after another asks again sooner
_LOOK_AGAIN_S = 0.03  # between looks whether somebody waits
_MOST_THREADS = 2  # each holds the decoded frames of one file: 50 MB of 1080p
_SHORTEST = 8  # images from a key frame to the next, 30 ms of 1080p: what is decoded as fast is not made beforehand
_LEAST_PRIORITY = 19  # of Linux


class _Plan:
    """The stretches of a video, from a key frame to the next, whose pictures are made."""

    def __init__(self, index: ImageIndex) -> None:
        """Leave out those that are decoded quickly."""
        n = len(index.facts.parities)
        firsts = np.searchsorted(index.ticks, index.keys) * n if len(index.keys) else np.zeros(1, int)
        lasts = np.append(firsts[1:], len(index)) - 1
        is_long = lasts - firsts >= _SHORTEST
        self._firsts, self._lasts = firsts[is_long], lasts[is_long]
        self._is_taken = np.zeros(len(self._firsts), bool)

    def nearest(self, number: int) -> tuple[float, int]:
        """Return how far, and which, the stretch nearest to an image is that is not taken; far: infinite."""
        far = np.maximum(np.maximum(self._firsts - number, number - self._lasts), 0.0)
        far[self._is_taken] = np.inf
        row = int(np.argmin(far)) if len(far) else 0
        return (float(far[row]) if len(far) else np.inf), row

    def take(self, row: int) -> range:
        """Return a stretch's images, once."""
        self._is_taken[row] = True
        return range(int(self._firsts[row]), int(self._lasts[row]) + 1)


class Prefetch:
    """Decodes videos of which pictures were asked for, each stretch once, until the store is full."""

    def __init__(
        self, store: JpegStore, index: Callable[[VideoSource], ImageIndex], encode: Callable[[Image, int], bytes]
    ) -> None:
        """Do nothing until `start`; `index` lists a video's images, `encode` makes a JPEG so many times smaller."""
        self._store, self._index, self._encode, self._lock = store, index, encode, threading.Lock()
        self._asked: dict[VideoSource, tuple[int, int]] = {}  # image and shrink that were asked for last
        self._plans: dict[tuple[VideoSource, int], _Plan] = {}
        self._n_waiting, self._asked_s, self._is_closed = 0, 0.0, False

    def start(self) -> None:
        """Begin, in threads that give way to everything else on the machine."""
        for _ in range(min(_MOST_THREADS, os.cpu_count() or 1)):
            threading.Thread(target=self._work, daemon=True, name="prefetch").start()

    def close(self) -> None:
        """End soon."""
        self._is_closed = True

    @contextmanager
    def waiting(self, key: Key, *, is_passing: bool) -> Iterator[None]:
        """Stand still while a picture is waited for; unless in passing, go on around it."""
        with self._lock:
            self._n_waiting += 1
            if not is_passing:
                self._asked[key.source] = key.number, key.shrink
        try:
            yield
        finally:
            with self._lock:
                self._n_waiting -= 1
                self._asked_s = time.monotonic()

    @property
    def _is_quiet(self) -> bool:
        return not self._n_waiting and time.monotonic() - self._asked_s > _QUIET_S

    def _wait(self) -> bool:
        """Wait until nobody waits; say whether to go on."""
        while not (self._is_closed or self._is_quiet):
            time.sleep(_LOOK_AGAIN_S)
        return not self._is_closed and not self._store.is_full

    def _work(self) -> None:
        if sys.platform == "linux":
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _LEAST_PRIORITY)  # there, of a thread
        while self._wait():
            with suppress(AirborneError, OSError):
                found = self._next()
                if found is None:
                    time.sleep(_QUIET_S)
                else:
                    self.fill(*found)

    def fill(self, source: VideoSource, shrink: int, numbers: range) -> None:
        """Make pictures that are not there. Raises VideoError."""
        with ImageReader(source, self._index(source)) as reader:
            for number in numbers:
                key = Key(source, number, shrink)
                if key in self._store:
                    continue
                if not self._wait():
                    return
                image = reader.image(number, is_exact=False)
                self._store.add(key, None if image is None else self._encode(image, shrink))

    def _next(self) -> tuple[VideoSource, int, range] | None:
        """Take the stretch nearest to what was asked for; None where all are taken."""
        with self._lock:
            asked = [(source, *wish) for source, wish in self._asked.items()]
        for source, _, shrink in asked:
            if (source, shrink) not in self._plans:
                self._plans[source, shrink] = _Plan(self._index(source))
        with self._lock:
            found = [(*self._plans[source, shrink].nearest(number), source, shrink) for source, number, shrink in asked]
            far, row, source, shrink = min(found, key=lambda each: each[0], default=(np.inf, 0, None, 0))
            return None if source is None or far == np.inf else (source, shrink, self._plans[source, shrink].take(row))
