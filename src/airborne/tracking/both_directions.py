"""Tracking between keys in both directions: forward from each key, backward from the next, joined frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Protocol

from airborne.body import BodyModel, Pose
from airborne.tracking.backward import turn_estimate, turn_time
from airborne.tracking.estimate import Estimate
from airborne.tracking.passes import Passes, differences, join_passes
from airborne.tracking.tracker import Tracker
from airborne.types import Array
from airborne.video import Frames


class TurningTracker(Tracker[Any, Estimate], Protocol):
    """A tracker that can go back in time, and weigh poses by the images alone."""

    def turn(self, state: Any) -> Any:
        """Return the state from which the body is tracked back in time, from frames with times counted backward."""
        ...

    def weigh(self, state: Any, frames: Frames, poses: Sequence[Pose]) -> Array:
        """Return minus the log-likelihood of the images in each of several poses: (n,) [nat]."""
        ...


class FrameReader(Protocol):
    """The frames of a recording, read again in any stretch."""

    def forward(self, start: int, stop: int | None) -> Iterator[Frames]:
        """Yield the frames from `start` to before `stop`."""
        ...

    def backward(self, start: int, stop: int) -> Iterator[Frames]:
        """Yield the same in reverse, the last one first."""
        ...


def track_between_keys(
    tracker: TurningTracker,
    model: BodyModel,
    reader: FrameReader,
    frames: range,
    *,
    keys: Sequence[int],
    write: Callable[[Estimate], None],
    done: Mapping[int, Estimate] | None = None,
    tick: Callable[[int], None] = lambda n_done: None,
) -> Iterator[tuple[Frames, Estimate]]:
    """Yield each time's frames with their estimate, as `track_frames`; `frames` are those to track, if they are there.

    `keys`, in the order of time, are those that have a key, beside the first of all, which always is one. What the
    tracker learns is what the joined estimates teach it, in the order of time: so a run is resumed, and frames that
    are `done` stay as they are, wherever they lie. `tick` takes how many frames are done.
    """
    state, known = tracker.init(), done or {}
    bounds, n_done = [frames.start, *(key + frames.step for key in (frames.start, *keys)), None], 0
    for start, stop in pairwise(bounds):
        ahead: dict[int, Estimate] = {}
        if (
            start > frames.start
            and stop is not None
            and any(frame not in known for frame in range(start, stop, frames.step))
        ):

            def report(n_tracked: int, n_before: int = n_done) -> None:
                tick(n_before + n_tracked // 2)

            stretch = range(start, stop, frames.step)
            ahead = _track_both_ways(tracker, model, reader, state=state, stretch=stretch, known=known, report=report)
        for observed in reader.forward(start, stop):
            estimate = known.get(observed.index)
            if estimate is None:
                estimate = ahead.get(observed.index) or tracker.search(state, observed)
                write(estimate)
            state, n_done = tracker.learn(state, observed, estimate), n_done + 1
            yield observed, estimate


def _track_both_ways(
    tracker: TurningTracker,
    model: BodyModel,
    reader: FrameReader,
    *,
    state: Any,
    stretch: range,
    known: Mapping[int, Estimate],
    report: Callable[[int], None],
) -> dict[int, Estimate]:
    """Track a stretch that ends with a key, both ways; a key that is known stays as it is."""
    key, forward = stretch[-1], dict[int, Estimate]()
    for observed in reader.forward(stretch.start, stretch.stop):
        estimate = (known.get(key) if observed.index == key else None) or tracker.search(state, observed)
        state, forward[observed.index] = tracker.learn(state, observed, estimate), estimate
        report(len(forward))
    if key not in forward or forward[key].pose is None:
        return forward  # the recording ends before, or the body is not seen there
    passes: list[Passes] = []
    state = tracker.turn(state)
    for observed in reader.backward(stretch.start, key):
        turned = turn_time(observed)
        back = tracker.search(state, turned)
        ahead = forward[observed.index]
        pair = differences(model, ahead, back)
        nats = None if not pair.candidates else tracker.weigh(state, turned, pair.candidates)
        passes.append(Passes(ahead, turn_estimate(back), pair, nats))
        state = tracker.learn(state, turned, back)
        report(len(forward) + len(passes))
    joined = join_passes(model, passes[::-1])
    return {**forward, **{estimate.index: estimate for estimate in joined}}
