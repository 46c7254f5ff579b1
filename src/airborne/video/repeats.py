"""Pictures of a video that repeat the one before, and videos whose pictures are all the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.video.decoding import DecodedImage
from airborne.video.outages import N_LISTED
from airborne.video.pixels import plane_rows

_N_SAMPLES = 8_000  # chosen: of a picture that are compared, whatever its size
_SHARE_BELOW = 0.998  # chosen: of the changes of its samples; a body covers a hundredth of a picture or less
# chosen on 34 recordings, 13 of them with repeated pictures: what moves changes samples from picture to picture by 5 to
# 139 grey levels, 0.34 times as much as to the picture before or more; a repeated and compressed one changes by 1 level
# or 0.11 times as much at most
_MOVING_GREY, _REPEATED_GREY, _REPEATED_SHARE = 6.0, 1.0, 0.15
_AGAIN_SHARE = 0.3  # chosen: the same where others were repeated before it: a key frame is compressed anew
_FEWEST, _MOST_CHANGED = 10, 0.1  # chosen: pictures of a still video at least; share of them that compression changes


@dataclass(slots=True, eq=False)
class PictureChanges:
    """How much each picture of a video differs from the one before; fields of one picture count once.

    A video may be read again: pictures up to the last one that was added are known already.
    """

    _repeated: set[Fraction] = field(default_factory=set)  # times of the images that repeat the ones before [s]
    _frame: av.VideoFrame | None = None
    _samples: NDArray[np.uint8] | None = None  # of the last picture that repeats none
    _time_s: Fraction | None = None
    _motion_grey: float = 0.0  # change by what moved to the last picture that repeats none; 0 if nothing did
    _is_repeated: bool = False  # the last picture
    _n: int = 0
    _n_changed: int = 0

    def add(self, image: DecodedImage) -> bool:
        """Add the next image; say whether it repeats the one before.

        It does where next to nothing changes from one to the other, but did before, or was repeated then already.
        """
        if self._time_s is None or image.time_s > self._time_s:
            if not self._is_last(image.frame):
                self._look_at(image.frame)
            self._time_s = image.time_s
            if self._is_repeated:
                self._repeated.add(image.time_s)
        return image.time_s in self._repeated

    def _is_last(self, frame: av.VideoFrame) -> bool:
        """Whether it is the picture looked at last, of which this is the other field; also in another reading."""
        last = self._frame
        return last is not None and (frame is last or (frame.pts is not None and frame.pts == last.pts))

    def _look_at(self, frame: av.VideoFrame) -> None:
        before, now, self._frame = self._samples, _samples_of(frame), frame
        if before is None or now is None or before.shape != now.shape:
            self._samples, self._motion_grey, self._is_repeated = now, 0.0, False
            return
        changes = cv2.absdiff(now, before).ravel()
        counts = np.bincount(changes, minlength=256).cumsum()
        usual, change = (int(counts.searchsorted(int(q * (len(changes) - 1)), "right")) for q in (0.5, _SHARE_BELOW))
        most = max(_REPEATED_GREY, (_AGAIN_SHARE if self._is_repeated else _REPEATED_SHARE) * self._motion_grey)
        self._is_repeated = self._motion_grey > 0 and change <= most
        if not self._is_repeated:  # where most of it changes it is a flash, a cut, or goes dark
            self._samples, self._motion_grey = now, change if change >= _MOVING_GREY > usual else 0.0
        self._n, self._n_changed = self._n + 1, self._n_changed + (change > 0)

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


def describe_repeats(repeats: Mapping[str, Sequence[tuple[int, int]]]) -> Iterator[str]:
    """Say which frames repeat the picture before them, by camera: runs of them from the first to the last."""
    cameras: dict[tuple[tuple[int, int], ...], list[str]] = {}
    for name, runs in repeats.items():
        cameras.setdefault(tuple(runs), []).append(name)
    for runs, names in cameras.items():
        listed = [f"{first}" if first == last else f"{first} to {last}" for first, last in runs[:N_LISTED]]
        more = f" and {len(runs) - N_LISTED} times more" if len(runs) > N_LISTED else ""
        is_one = len(runs) == 1 and runs[0][0] == runs[0][1]
        repeats_it = "repeats the picture before it and is" if is_one else "repeat the picture before them and are"
        yield (
            f"{', '.join(names)}: frame{'' if is_one else 's'} {', '.join(listed)}{more} {repeats_it} left out; if the "
            f"camera{'s' if len(names) > 1 else ''} filmed on, later pictures are late: take the repeated ones out of "
            f"the video{'s' if len(names) > 1 else ''}"
        )
