"""Tracking back in time: frames whose order and times are reversed look like any others to a tracker."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

from airborne.tracking.estimate import Estimate
from airborne.video import Frames

Write = Callable[[Estimate], None]
Tracked = Iterator[tuple[Frames, Estimate]]
Track = Callable[[Iterable[Frames], Write, Mapping[int, Estimate]], Tracked]  # as `track_frames` does


def turn_time(frames: Frames) -> Frames:
    """Return frames with their numbers and times counted backward."""
    views = (view and replace(view, delay_s=-view.delay_s) for view in frames.views)
    return replace(frames, index=-frames.index, time_s=-frames.time_s, views=tuple(views))


def turn_estimate(estimate: Estimate) -> Estimate:
    """Return an estimate with its number and time counted backward."""
    return replace(estimate, index=-estimate.index, time_s=-estimate.time_s)


def track_back(
    track: Track, frames: Iterable[Frames], start: int, *, write: Write, done: Mapping[int, Estimate]
) -> Tracked:
    """Yield earlier and earlier frames with their estimates, written, after the one in which the body is known.

    `frames` begin with that one, `start`, which is neither written nor yielded. `track` tracks what is turned as if it
    were a recording of its own.
    """

    def write_turned(estimate: Estimate) -> None:
        if estimate.index != -start:
            write(turn_estimate(estimate))

    known = {-index: turn_estimate(estimate) for index, estimate in done.items()}
    for observed, estimate in track(map(turn_time, frames), write_turned, known):
        if observed.index != -start:
            yield turn_time(observed), turn_estimate(estimate)
