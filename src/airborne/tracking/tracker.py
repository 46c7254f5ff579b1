"""The protocol of trackers: a first state, and search and learning from one state and one time's frames to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Protocol, TypeVar

from airborne.video import Frames

StateT = TypeVar("StateT")
Found = TypeVar("Found")


class Tracker(Protocol[StateT, Found]):
    """A tracker holds its settings; what it learns is in the states it returns. `search` and `learn` are pure.

    What it finds at one time is an `Estimate` of a body, or a `PlayersStep`.
    """

    def init(self) -> StateT:
        """Return the state before the first frame."""
        ...

    def search(self, state: StateT, frames: Frames) -> Found:
        """Find the body or the players in the frames, without learning from them."""
        ...

    def learn(self, state: StateT, frames: Frames, estimate: Found) -> StateT:
        """Return the state after the frames, given their estimate: a run is resumed by learning alone."""
        ...


def step(tracker: Tracker[StateT, Found], state: StateT, frames: Frames) -> tuple[StateT, Found]:
    """Track one time: search, then learn."""
    estimate = tracker.search(state, frames)
    return tracker.learn(state, frames, estimate), estimate


def track_frames(
    tracker: Tracker[StateT, Found],
    frames: Iterable[Frames],
    write: Callable[[Found], None],
    done: Mapping[int, Found] | None = None,
) -> Iterator[tuple[Frames, Found]]:
    """Yield each time's frames with their estimate, written as soon as it is found.

    Estimates of some frames, by their numbers, may be `done` by an earlier run: there the tracker only learns.
    """
    state, known = tracker.init(), done or {}
    for observed in frames:
        estimate = known.get(observed.index)
        if estimate is None:
            estimate = tracker.search(state, observed)
            write(estimate)
        state = tracker.learn(state, observed, estimate)
        yield observed, estimate
