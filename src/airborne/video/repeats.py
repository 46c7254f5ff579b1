"""Pictures of a video that repeat the one before, and videos whose pictures are all the same."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.video.decoding import DecodedImage
from airborne.video.pixels import plane_rows

_N_SAMPLES = 8_000  # chosen: of a picture that are compared, whatever its size
_SHARE_BELOW = 0.998  # chosen: of the changes of its samples; a body covers a hundredth of a picture or less
# chosen, and looked at on six synthetic throws and somersaults, in one with a picture repeated: from one picture to the
# next the body changes its samples by 18 to 118 grey levels, a repeated and compressed one by up to 1
_LEAST_GREY, _STILL = 16.0, 0.25  # change by which something moves; and share of that beside which is none
_FEWEST, _MOST_CHANGED = 10, 0.1  # chosen: pictures of a still video at least; share of them that compression changes


@dataclass(slots=True, eq=False)
class PictureChanges:
    """How much each picture of a video differs from the one before; fields of one picture count once.

    A video may be read again: pictures up to the last one that was added are known already.
    """

    n_repeated: int = 0
    _frame: av.VideoFrame | None = None
    _samples: NDArray[np.uint8] | None = None
    _time_s: Fraction | None = None
    _last: list[float] = field(default_factory=list)  # up to three changes [grey levels]
    _n: int = 0
    _n_changed: int = 0

    def add(self, image: DecodedImage) -> Fraction | None:
        """Add the next image; return the time of the picture before it where that repeats its own forerunner [s].

        It does where next to nothing changes from one to the other, but does before and after.
        """
        if image.frame is self._frame or (self._time_s is not None and image.time_s <= self._time_s):
            return None
        before, now, before_s = self._samples, _samples_of(image.frame), self._time_s
        self._frame, self._samples, self._time_s = image.frame, now, image.time_s
        if before is None or now is None or before.shape != now.shape:
            self._last = []
            return None
        changes = cv2.absdiff(now, before).ravel()
        counts = np.bincount(changes, minlength=256).cumsum()
        change = float(counts.searchsorted(int(_SHARE_BELOW * (len(changes) - 1)), side="right"))
        self._last = [*self._last[-2:], change]
        self._n, self._n_changed = self._n + 1, self._n_changed + (change > 0)
        least = min(self._last[0], change)
        is_repeated = len(self._last) == 3 and least >= _LEAST_GREY and self._last[1] < _STILL * least
        self.n_repeated += is_repeated
        return before_s if is_repeated else None

    @property
    def is_still(self) -> bool:
        """Whether all pictures are the same."""
        return self._n >= _FEWEST and self._n_changed <= _MOST_CHANGED * self._n


def _samples_of(frame: av.VideoFrame) -> NDArray[np.uint8] | None:
    """Return some samples of a picture's first plane, of its brightness in most formats; None beyond 8 bits."""
    if any(component.bits != 8 for component in frame.format.components):
        return None
    n_bytes = frame.format.padded_bits_per_pixel // 8 if len(frame.planes) == 1 else 1  # of a pixel
    rows = plane_rows(frame.planes[0])[:, : n_bytes * frame.width]  # without padding, which holds anything
    every = max(math.isqrt(frame.width * frame.height // _N_SAMPLES), 1)
    return np.ascontiguousarray(rows[::every, ::every])


def describe_repeat(name: str, frame: int, time_s: Fraction) -> str:
    """Say which frame of a camera repeats the one before, and what that means."""
    return (
        f"{name}: frame {frame} ({float(time_s):.3f} s) repeats the picture before it: if the camera filmed on, its "
        "pictures are late from there; take the repeated one out of the video"
    )
