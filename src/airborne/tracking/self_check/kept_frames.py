"""Some frames of a run, kept while it is tracked, to be looked at again when it has ended."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airborne.geometry.even_sample import EvenSample
from airborne.video import Frames

# of all that are kept, chosen: of 33 synthetic runs of people, four cameras of 960 x 720 of which one was turned, late
# or had another focal length, 17 name it, and of six right ones none names any; with 120 MB 7, as 9 say nothing
_MOST_BYTES = 3e8
_MOST_KEPT, _FEWEST_KEPT = 24, 8  # frames, whatever their bytes


class KeptFrames:
    """Frames spread evenly over a run, as many as may be."""

    def __init__(self) -> None:
        self._kept: EvenSample[Frames] | None = None

    def add(self, frames: Frames) -> None:
        """Keep the frames, or not."""
        if self._kept is None:
            self._kept = EvenSample(int(np.clip(_MOST_BYTES / max(frames.n_bytes, 1), _FEWEST_KEPT, _MOST_KEPT)))
        self._kept.offer(lambda: frames)

    def __iter__(self) -> Iterator[Frames]:
        return iter(() if self._kept is None else self._kept)
