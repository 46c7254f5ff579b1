"""Some frames of a run, kept while it is tracked, to be looked at again when it has ended."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airborne.video import Frames

_MOST_BYTES = 120e6  # of all that are kept
_MOST_KEPT, _FEWEST_KEPT = 24, 8  # frames, whatever their bytes


class KeptFrames:
    """Frames of a run, spread evenly over all of it: every second one is let go whenever there are too many."""

    def __init__(self) -> None:
        self._stride, self._n, self._most = 1, 0, 0
        self._kept: list[tuple[int, Frames]] = []

    def add(self, frames: Frames) -> None:
        """Keep the frames, or not."""
        if not self._most:
            size = sum(view.rgb.nbytes for view in frames.views if view is not None)
            self._most = int(np.clip(_MOST_BYTES / max(size, 1), _FEWEST_KEPT, _MOST_KEPT))
        if self._n % self._stride == 0:
            self._kept.append((self._n, frames))
        self._n += 1
        if len(self._kept) > self._most:
            self._stride *= 2
            self._kept = [each for each in self._kept if each[0] % self._stride == 0]

    def __iter__(self) -> Iterator[Frames]:
        return (frames for _, frames in self._kept)
