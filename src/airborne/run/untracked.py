"""A run of a body of which no frame is tracked: which mix-up, which camera or which size of the body explains that."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import NamedTuple

from airborne.body import BodyModel, Pose
from airborne.body.shaping import with_size
from airborne.run.mix_ups import MixUp, start_foregrounds, undecided_mix_ups
from airborne.tracking import Status
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import track_frames
from airborne.types import Progress
from airborne.video import Frames, Recording

# chosen: of so many first frames most must be tracked. Of the example with exchanged or mirrored videos that is each of
# the first frames, and none as they are
_N_FRAMES = 5
_FEWEST_CAMERAS = 2  # that locate a body when one is left out
_SIZES = (0.9, 1.1)  # chosen: of the body, tried in the place of its own


class Explanation(NamedTuple):
    """What would let the first frames of a run be tracked, if anything was found."""

    sentence: str
    is_mix_up: bool  # videos are not those of their cameras, of which the self-check then says nothing right


@dataclass(frozen=True, slots=True, eq=False)
class _Change:
    """Something that may be wrong with a run, and how its first frames would be without it."""

    model: BodyModel
    undo: Callable[[Frames], Frames | None] = lambda frames: frames
    mix_up: MixUp | None = None
    camera: str | None = None  # that is left out
    size: float | None = None  # of the body, as a share of its own


def explain_untracked(
    settings: Settings, model: BodyModel, start: Pose, recording: Recording, progress: Progress | None = None
) -> Explanation:
    """Say with which videos exchanged or mirrored, without which camera or with which size the body would be tracked.

    One is named where it lets most of the first frames be tracked and they are not as they are; beside it, those that
    let as many. Of them a mix-up goes first, as a camera with wrong images can be left out as well: only such are tried
    as what stands out at the start does not speak against.
    """
    with closing(iter(recording)) as frames:
        first = list(islice(frames, _N_FRAMES))
    names = recording.rig.names
    with start_foregrounds(recording) as foregrounds:
        mix_ups = undecided_mix_ups(recording.rig, list(foregrounds), model, start)
    changes = [_Change(model, mix_up.undo, mix_up=mix_up) for mix_up in mix_ups]
    if len(names) > _FEWEST_CAMERAS:
        changes += [_Change(model, partial(_leave_out, i), camera=name) for i, name in enumerate(names)]
    changes += [_Change(with_size(model, size), size=size) for size in _SIZES]

    def count_tracked(number: int, change: _Change) -> int:
        if progress is not None:
            progress(number, 1 + len(changes))
        changed = [each for each in map(change.undo, first) if each is not None]
        tracked = track_frames(tracker_of(settings, change.model, start), changed, lambda _: None)
        return sum(estimate.status is Status.TRACKED for _, estimate in tracked)

    n = count_tracked(0, _Change(model))
    if _is_most(n):
        return Explanation(
            f"{n} of the first {len(first)} frames are tracked when nothing but them is looked at, with the videos and "
            "cameras as they are: are the body's size and the calibration right, and the pictures sharp? Look at the "
            "overlay videos where it goes wrong, and give the pose there by a [[key]]",
            False,
        )
    counts = [count_tracked(number, change) for number, change in enumerate(changes, start=1)]
    most = max(counts)
    best = [change for change, n in zip(changes, counts, strict=True) if n == most] if _is_most(most) else []
    return _explain(
        best, names, f"{most} of the first {len(first)} frames are tracked", has_tried_mix_ups=bool(mix_ups)
    )


def _explain(best: list[_Change], names: tuple[str, ...], how_many: str, *, has_tried_mix_ups: bool) -> Explanation:
    """Say what the changes that let most of the first frames be tracked, alike many, tell."""
    of_mix_up = [change.mix_up for change in best if change.mix_up is not None]
    if len(of_mix_up) == 1:
        what = f"with {of_mix_up[0].describe(names)}, {how_many}"
        return Explanation(of_mix_up[0].finding(names, what).sentence, True)
    sizes = [change.size for change in best if change.size is not None]
    cameras = [change.camera for change in best if change.camera is not None]
    cameras = cameras if 2 * len(cameras) <= len(names) else []  # most can be left out: it is none of them
    ways, questions, mends = [], [], []
    if len(sizes) == 1:
        ways.append(f"with a body {abs(sizes[0] - 1):.0%} {'smaller' if sizes[0] < 1 else 'larger'}")
        questions.append("are the body's stature, mass and file right")
        mends.append("Correct the body")
    if cameras:
        ways.append(f"without {' or without '.join(cameras)}")
        it = "it" if len(cameras) == 1 else "one of them"
        questions.append(f"was {it} moved, or calibrated wrongly, or is its clock off")
        mends.append(f"{'or calibrate' if mends else 'Calibrate'} it again, or leave it out (--cameras)")
    if ways:
        return Explanation(f"{' and '.join(ways)}, {how_many}: {', or '.join(questions)}? {', '.join(mends)}", False)
    tried = ["with videos exchanged or mirrored"] * has_tried_mix_ups
    tried += ["with one camera left out"] * (len(names) > _FEWEST_CAMERAS) + ["with another size of the body"]
    return Explanation(
        f"the first frames are not tracked either {', nor '.join(tried)}: are [start], the body and the "
        "calibration right?",
        False,
    )


def _is_most(n: int) -> bool:
    return 2 * n > _N_FRAMES


def _leave_out(number: int, frames: Frames) -> Frames | None:
    """Return frames without one camera's image; None where it has none."""
    if frames.views[number] is None:
        return None
    return replace(frames, views=tuple(None if i == number else view for i, view in enumerate(frames.views)))
