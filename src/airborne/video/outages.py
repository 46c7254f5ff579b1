"""When which camera shows nothing: no picture, or a dark one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

from airborne.video.frames import Frames, View

DARK_GREY = 16  # a picture in which no patch has a pixel this bright shows nothing
PATCHES, PATCH_PX = 6, 8  # patches along each side of the picture that are looked at, and their size
LISTED = 5  # stretches told by their frames; of more only their number


@dataclass(slots=True, eq=False)
class _Stretches:
    """Runs of frames, counted; the first few are kept."""

    n_frames: int = 0
    n_stretches: int = 0
    ends: list[list[int]] = field(default_factory=list)  # first and last frame of each that is kept
    _at: int = -2  # how many times were seen before the last one added

    def add(self, index: int, time: int) -> None:
        """Add a frame; `time` counts the times one by one, whatever the frames' numbers."""
        self.n_frames += 1
        is_new = time != self._at + 1
        self._at = time
        self.n_stretches += is_new
        if is_new and len(self.ends) < LISTED:
            self.ends.append([index, index])
        elif self.n_stretches <= LISTED:
            self.ends[-1][1] = index

    def described(self) -> str:
        """Name the frames: "frames 3 to 9, 12"."""
        listed = ", ".join(f"{a} to {b}" if a != b else f"{a}" for a, b in self.ends)
        more = self.n_stretches - len(self.ends)
        return f"frame{'s' if self.n_frames > 1 else ''} {listed}" + (f" and {more} more times" if more else "")


@dataclass(slots=True, eq=False)
class Outages:
    """Watches the cameras of a run; what it remembers does not grow with the run."""

    names: Sequence[str]  # of the cameras, in the rig's order
    _n_times: int = 0
    _missing: dict[str, _Stretches] = field(default_factory=dict)
    _dark: dict[str, _Stretches] = field(default_factory=dict)

    def add(self, frames: Frames) -> None:
        """Look at one time."""
        for name, view in zip(self.names, frames.views, strict=True):
            if view is None:
                self._missing.setdefault(name, _Stretches()).add(frames.index, self._n_times)
            elif is_dark(view):
                self._dark.setdefault(name, _Stretches()).add(frames.index, self._n_times)
        self._n_times += 1

    def described(self) -> Iterator[str]:
        """Say in a sentence for each camera and kind of outage when it was."""
        for kind, found in (("no picture", self._missing), ("dark", self._dark)):
            for name, stretches in found.items():
                yield f"{name}: {kind} at {stretches.n_frames} of {self._n_times} frames: {stretches.described()}"


def is_dark(view: View) -> bool:
    """Say whether a picture shows nothing: no bright pixel in a grid of patches."""
    width, height = view.camera.size
    size = min(PATCH_PX, width, height)
    for i, j in product(range(PATCHES), repeat=2):
        x, y = i * (width - size) // (PATCHES - 1), j * (height - size) // (PATCHES - 1)
        if view.crop((x, y, x + size, y + size)).max() >= DARK_GREY:
            return False
    return True
