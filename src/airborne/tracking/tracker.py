"""The protocol of trackers: a first state, and a step from one state and one time's frames to the next."""

from __future__ import annotations

from typing import Any, Protocol

from airborne.tracking.estimate import Estimate
from airborne.video import Frames


class Tracker(Protocol):
    """A tracker holds its settings; what it learns is in the states it returns."""

    def init(self) -> Any:
        """Return the state before the first frame."""
        ...

    def search(self, state: Any, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        ...

    def learn(self, state: Any, frames: Frames, estimate: Estimate) -> Any:
        """Return the state after the frames, given their estimate: a run is resumed by learning alone."""
        ...


def step(tracker: Tracker, state: Any, frames: Frames) -> tuple[Any, Estimate]:
    """Track one time: search, then learn."""
    estimate = tracker.search(state, frames)
    return tracker.learn(state, frames, estimate), estimate
