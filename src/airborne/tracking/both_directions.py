"""Tracking in both directions: forward, from a key or the last frame held backward, joined frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any, Protocol

from airborne.body import BodyModel, Pose
from airborne.tracking.backward import turn_estimate, turn_time
from airborne.tracking.estimate import Doubt, Estimate, Status, has_unknown_limb, with_doubt
from airborne.tracking.passes import Passes, differences, join_passes
from airborne.tracking.tracker import Tracker
from airborne.types import Array
from airborne.video import Frames

_MOST_BYTES = 6e8  # of pictures of a stretch that are held at once, as if converted
_FEWEST_HELD = 16  # frames, whatever their bytes: limbs are lost for as long
_ELSEWHERE_SHARE = 0.35  # of the segments after the root, of a person two limbs; chosen on synthetic people in two and
# three views: 386 joints are then tracked with bodies a tenth too tall, none of them 0.1 m off, and 1521, of which 60
# are, without; with right bodies 10503 and 10798, of which none is


class TurningTracker(Tracker[Any, Estimate], Protocol):
    """A tracker that can go back in time, and weigh poses by the images alone."""

    def turn(self, state: Any, forward: Mapping[int, Estimate]) -> Any:
        """Return the state from which the body is tracked back in time, from frames with times counted backward.

        `forward`: what was found in them forward in time, by frame, numbers and times counted backward too.
        """
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
    stretches = _Stretches(tracker, model, write, done or {}, tick, tracker.init())
    bounds = [frames.start, *(key + frames.step for key in (frames.start, *keys)), None]
    for start, stop in pairwise(bounds):
        stretch = None if start == frames.start or stop is None else range(start, stop, frames.step)
        yield from stretches.track(reader, start, stop, stretch)


def track_forward_backward(
    tracker: TurningTracker,
    model: BodyModel,
    frames: Iterable[Frames],
    *,
    write: Callable[[Estimate], None],
    done: Mapping[int, Estimate] | None = None,
    tick: Callable[[int], None] = lambda n_done: None,
) -> Iterator[tuple[Frames, Estimate]]:
    """Yield each time's frames with their estimate, as `track_frames`, tracked in both directions without any key.

    Stretches as long as memory holds are tracked forward and, where some frame or limb is in doubt, then back from the
    last pose that was found, and joined as between keys. The first frame, in which the body is known, is tracked once.
    After a stretch in which the body was lost no frame is tracked until a stretch leaves nothing in doubt.
    """
    stretches = _Stretches(tracker, model, write, done or {}, tick, tracker.init())
    source = iter(frames)
    first = next(source, None)
    if first is None:
        return
    yield from stretches.track(_HeldFrames([first]), first.index, None, None)
    n_held = max(int(_MOST_BYTES / max(first.n_bytes, 1)), _FEWEST_HELD)
    held = list(islice(source, n_held))
    while held:
        following = list(islice(source, 1))
        step = held[1].index - held[0].index if len(held) > 1 else 1
        stretch = range(held[0].index, held[-1].index + step, step)
        args = _HeldFrames(held), stretch.start, stretch.stop, stretch
        yield from stretches.track(*args, only_if_doubtful=True, is_last=not following)
        held = following + list(islice(source, n_held - 1)) if following else []


@dataclass(frozen=True, slots=True)
class _HeldFrames:
    """Frames in memory, in the order of time, as a `FrameReader`."""

    frames: Sequence[Frames]

    def forward(self, start: int, stop: int | None) -> Iterator[Frames]:
        """Yield the frames from `start` to before `stop`."""
        return (each for each in self.frames if start <= each.index and (stop is None or each.index < stop))

    def backward(self, start: int, stop: int) -> Iterator[Frames]:
        """Yield the same in reverse, the last one first."""
        return reversed(list(self.forward(start, stop)))


@dataclass(slots=True, eq=False)
class _Stretches:
    """A run's stretches, one after the other; the tracker learns what the joined estimates teach it."""

    tracker: TurningTracker
    model: BodyModel
    write: Callable[[Estimate], None]
    known: Mapping[int, Estimate]
    tick: Callable[[int], None]
    state: Any
    n_done: int = 0
    is_lost: bool = False  # no frame of the last stretch that went both ways is tracked

    def track(
        self,
        reader: FrameReader,
        start: int,
        stop: int | None,
        both_ways: range | None,
        *,
        only_if_doubtful: bool = False,
        is_last: bool = False,
    ) -> Iterator[tuple[Frames, Estimate]]:
        """Yield the frames from `start` to before `stop` with their estimates; `both_ways`, else forward alone.

        Nothing is learned from the joined estimates of a stretch that `is_last`.
        """
        ahead, learned = dict[int, Estimate](), None
        if both_ways is not None and any(frame not in self.known for frame in both_ways):
            ahead, learned = _track_both_ways(
                self.tracker,
                self.model,
                reader,
                state=self.state,
                stretch=both_ways,
                known=self.known,
                only_if_doubtful=only_if_doubtful,
                is_lost=self.is_lost,
                report=lambda n_tracked: self.tick(self.n_done + n_tracked // 2),
            )
        is_tracked = False
        for observed in reader.forward(start, stop):
            estimate = self.known.get(observed.index)
            if estimate is None:
                estimate = ahead.get(observed.index) or self.tracker.search(self.state, observed)
                self.write(estimate)
            self.n_done += 1
            is_tracked |= estimate.status is Status.TRACKED
            if learned is None and not is_last:
                self.state = self.tracker.learn(self.state, observed, estimate)
            yield observed, estimate
        self.state = self.state if learned is None else learned
        self.is_lost = both_ways is not None and not is_tracked


def _track_both_ways(
    tracker: TurningTracker,
    model: BodyModel,
    reader: FrameReader,
    *,
    state: Any,
    stretch: range,
    known: Mapping[int, Estimate],
    only_if_doubtful: bool,
    is_lost: bool,
    report: Callable[[int], None],
) -> tuple[dict[int, Estimate], Any]:
    """Track a stretch both ways, from its last frame with a pose back; if that is known it stays as it is.

    Where the body `is_lost` and some doubt goes on, both ways may follow the same wrong pose: no frame is tracked.
    Return the estimates, and what the tracker has learned by the end of a stretch that was tracked forward alone.
    """
    last, forward = stretch[-1], dict[int, Estimate]()
    for observed in reader.forward(stretch.start, stretch.stop):
        estimate = (known.get(last) if observed.index == last else None) or tracker.search(state, observed)
        state, forward[observed.index] = tracker.learn(state, observed, estimate), estimate
        report(len(forward))
    turn = max((index for index, estimate in forward.items() if estimate.pose is not None), default=None)
    is_doubtful = any(_is_doubtful(model, estimate) for estimate in forward.values())
    if turn is None or (only_if_doubtful and not is_doubtful):
        return forward, None if known.keys() & forward.keys() else state
    passes: list[Passes] = []
    state = tracker.turn(state, {-index: turn_estimate(estimate) for index, estimate in forward.items()})
    for observed in reader.backward(stretch.start, turn):
        turned = turn_time(observed)
        back = tracker.search(state, turned)
        ahead = forward[observed.index]
        pair = differences(model, ahead, back)
        nats = None if not pair.candidates else tracker.weigh(state, turned, pair.candidates)
        passes.append(Passes(ahead, turn_estimate(back), pair, nats))
        state = tracker.learn(state, turned, back)
        report(len(forward) + len(passes))
    found = {**forward, **{estimate.index: estimate for estimate in join_passes(model, passes[::-1])}}
    if only_if_doubtful and (is_lost or _ends_elsewhere(passes)):
        return {index: with_doubt(each, Doubt.DIRECTIONS) for index, each in found.items()}, None
    return found, None


def _ends_elsewhere(passes: Sequence[Passes]) -> bool:
    """Whether a pass back in time does not end where the pass forward began, which is known: either was lost between.

    Only images tell which. If it is the one forward, both are wrong from there on, where they agree.
    """
    is_far = next((each.difference.is_far[1:] for each in reversed(passes) if len(each.difference.is_far) > 1), None)
    return is_far is not None and bool(is_far.mean() >= _ELSEWHERE_SHARE)


def _is_doubtful(model: BodyModel, estimate: Estimate) -> bool:
    """Whether a frame is not tracked, or the images do not show some limb where it is said to be."""
    return estimate.status is not Status.TRACKED or has_unknown_limb(estimate, model)
