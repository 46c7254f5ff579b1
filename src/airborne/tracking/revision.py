"""Revision: a limb that was found again is tracked back to where it was lost, before its frames are written.

Estimates are held back by a fixed lag. Where a limb was found away from where it had been followed to, the tracker is
asked which of the estimates that are held should have it elsewhere too, and what it has learned from these is learned
anew. So no frame is written twice, and a run that was broken off goes on to the same result: what a revision changed
leaves together.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from airborne.tracking.estimate import Estimate
from airborne.tracking.tracker import Tracker
from airborne.video import Frames

LAG = 16  # frames; on synthetic somersaults no limb was followed back by more than 11
_MOST_BYTES = 3e8  # of pictures held at once, and as much of backgrounds: fewer frames of large ones are held


@dataclass(slots=True, eq=False)
class FrameRecord:
    """One time that is held: its frames, what the tracker knew before them, and what it found."""

    frames: Frames
    state: Any
    estimate: Estimate
    last: int  # the frame with which it is written: its own, or that of the revision that changed it
    is_known: bool  # was written by an earlier run
    is_out: bool = False  # is written and yielded


class RevisingTracker(Tracker[Any, Estimate], Protocol):
    """A tracker of a body with limbs, which may say later where a limb has been."""

    def revise(self, records: Sequence[FrameRecord], state: Any) -> dict[int, Estimate]:
        """Return better estimates of earlier records, by frame, given the newest one and the state after it."""
        ...


def track_with_revision(
    tracker: RevisingTracker,
    frames: Iterable[Frames],
    write: Callable[[Estimate], None],
    done: Mapping[int, Estimate] | None = None,
    *,
    lag: int = LAG,
    tick: Callable[[int], None] = lambda n_done: None,
) -> Iterator[tuple[Frames, Estimate]]:
    """Yield each time's frames with their estimate, as `track_frames` does, by up to `lag` frames late.

    `tick` takes how many frames are tracked.
    """
    state, known, held = tracker.init(), done or {}, deque[FrameRecord]()
    for number, observed in enumerate(frames, start=1):
        before, estimate = state, known.get(observed.index)
        record = FrameRecord(
            observed, before, estimate or tracker.search(before, observed), observed.index, bool(estimate)
        )
        held.append(record)
        state = tracker.learn(before, observed, record.estimate)
        if estimate is None and record.estimate.moved:
            state = _revise(tracker, held, state)
        tick(number)
        while len(held) > min(lag, _most_held(observed)):
            yield from _release(held, write)
            held.popleft()
    while any(not record.is_out for record in held):
        yield from _release(held, write)
        held.popleft()


def _revise(tracker: RevisingTracker, held: Sequence[FrameRecord], state: Any) -> Any:
    """Replace what is revised of the records that are held; return the state after the newest."""
    revised, newest = tracker.revise(list(held), state), held[-1]
    is_open = [not (record.is_out or record.is_known) for record in held]
    changed = [k for k, record in enumerate(held) if is_open[k] and record.frames.index in revised]
    if not changed:
        return state
    before = held[changed[0]].state
    for k in range(changed[0], len(held)):
        record = held[k]
        record.state, record.last = before, newest.frames.index
        record.estimate = revised.get(record.frames.index, record.estimate)
        before = tracker.learn(before, record.frames, record.estimate)
    return before


def _release(held: Sequence[FrameRecord], write: Callable[[Estimate], None]) -> Iterator[tuple[Frames, Estimate]]:
    """Write and yield the oldest record, if that is to be done yet, and with it what one revision changed."""
    last, due = held[0].last, list[FrameRecord]()
    for record in held:
        if record.frames.index > last:
            break
        last = max(last, record.last)
        if not record.is_out:
            due.append(record)
    for record in due:
        if not record.is_known:
            write(record.estimate)
    for record in due:
        record.is_out = True
        yield record.frames, record.estimate


def _most_held(frames: Frames) -> int:
    return int(_MOST_BYTES // max(frames.n_bytes, 1))
