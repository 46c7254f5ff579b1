"""Outages of cameras: when each delivers no image, or a dark one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from airborne.video.frames import Frames, View

DARK_LEVEL = 16  # an image without a pixel this bright in any patch shows nothing
_N_PATCHES, _PATCH_PX = 6, 8  # patches along each side of the image that are tested, and their size
N_LISTED = 5  # runs listed by their frames; of further ones only the number is stated


@dataclass(slots=True, eq=False)
class _FrameRuns:
    """Runs of consecutive frames, upward or downward: their number, and the ends of the first few."""

    n_frames: int = 0
    n_runs: int = 0
    ends: list[list[int]] = field(default_factory=list)  # first and last frame of each listed run
    _at: int = -2  # position, among all times, of the last one added

    def add(self, index: int, time: int) -> None:
        """Add a frame; `time` counts the times one by one, whatever the frames' numbers."""
        self.n_frames += 1
        is_new = time != self._at + 1
        self._at = time
        self.n_runs += is_new
        if is_new and len(self.ends) < N_LISTED:
            self.ends.append([index, index])
        elif self.n_runs <= N_LISTED:
            self.ends[-1][1] = index

    def describe(self) -> str:
        """Name the frames: "frames 3 to 9, 12"."""
        listed = ", ".join(f"{a} to {b}" if a != b else f"{a}" for a, b in map(sorted, self.ends))
        more = self.n_runs - len(self.ends)
        return f"frame{'s' if self.n_frames > 1 else ''} {listed}" + (f" and {more} more times" if more else "")


@dataclass(slots=True, eq=False)
class Outages:
    """Watches the cameras of a recording; its memory does not grow with the recording."""

    names: Sequence[str]  # of the cameras, in the rig's order
    masked: Mapping[str, Sequence[tuple[int, int]]] = field(
        default_factory=dict
    )  # camera -> first and last frames of it
    _n_times: int = 0
    _last: int = -1  # frame
    _n_jumps: int = 0  # 1 once frames before the start are added, the last one first: no run lasts over the jump
    _missing: dict[str, _FrameRuns] = field(default_factory=dict)
    _dark: dict[str, _FrameRuns] = field(default_factory=dict)

    def add(self, frames: Frames) -> None:
        """Record the outages of one time; an image that is masked is none."""
        if frames.index < self._last:
            self._n_jumps = 1
        self._last, place = frames.index, self._n_times + self._n_jumps
        for name, view in zip(self.names, frames.views, strict=True):
            if view is None and any(first <= frames.index <= last for first, last in self.masked.get(name, ())):
                continue
            if view is None:
                self._missing.setdefault(name, _FrameRuns()).add(frames.index, place)
            elif is_dark(view):
                self._dark.setdefault(name, _FrameRuns()).add(frames.index, place)
        self._n_times += 1

    def describe(self) -> Iterator[str]:
        """State in a sentence when each camera had each kind of outage."""
        for kind, runs_by_camera in (("no image", self._missing), ("dark", self._dark)):
            for name, runs in runs_by_camera.items():
                yield f"{name}: {kind} at {runs.n_frames} of {self._n_times} frames: {runs.describe()}"


def is_dark(view: View, level: int = DARK_LEVEL) -> bool:
    """Say whether an image shows nothing: no pixel as bright as `level` in a grid of patches."""
    width, height = view.camera.size
    size = min(_PATCH_PX, width, height)
    for i, j in product(range(_N_PATCHES), repeat=2):
        x, y = i * (width - size) // (_N_PATCHES - 1), j * (height - size) // (_N_PATCHES - 1)
        if view.crop((x, y, x + size, y + size)).max() >= level:
            return False
    return True
