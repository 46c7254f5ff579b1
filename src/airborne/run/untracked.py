"""A run of which hardly a frame is tracked: which mix-up, which camera or which size of the body explains that."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import NamedTuple

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.body.shaping import with_size
from airborne.run.mix_ups import MixUp, find_undecided_mix_ups, start_foregrounds
from airborne.run.moving_mix_ups import MovingSilhouettes
from airborne.tracking import Estimate, Status
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import track_frames
from airborne.types import Progress
from airborne.video import Frames, Recording
from airborne.video.decoding import FieldOrder

# chosen: of so many first frames most must be tracked. Of the example with exchanged or mirrored videos that is each of
# the first frames, and none as they are
_N_FRAMES = 5
# chosen, and looked at on four synthetic throws: first fields that are tracked in the other order, too; share of the
# path's bends that is left then, as 2.5 to 3.6 % were
_N_FIELDS, _SMOOTHER = 16, 0.25
_OTHER_ORDER: Mapping[FieldOrder, FieldOrder] = {
    "progressive": "progressive",
    "top-first": "bottom-first",
    "bottom-first": "top-first",
}
_FEWEST_CAMERAS = 2  # that locate a body when one is left out
_SIZES = (0.9, 1.1)  # chosen: of the body, tried in the place of its own


class Explanation(NamedTuple):
    """What would let the first frames of a run be tracked, if anything was found."""

    sentence: str
    is_mix_up: bool  # videos or fields are mixed up, and the self-check says nothing right of their cameras
    is_cause: bool = True  # something that was tried lets them be tracked


@dataclass(frozen=True, slots=True, eq=False)
class _Change:
    """Something that may be wrong with a run, and how its first frames would be without it."""

    model: BodyModel
    undo: Callable[[Frames], Frames | None] = lambda frames: frames
    mix_up: MixUp | None = None
    camera: str | None = None  # that is left out
    size: float | None = None  # of the body, as a share of its own


def explain_by_silhouettes(seen: MovingSilhouettes) -> Explanation | None:
    """Say what the silhouettes of what moves show to be wrong with the videos; None where they show nothing."""
    if seen.mix_up is not None:
        return Explanation(seen.mix_up, True)
    return Explanation(seen.doubts[0], False) if seen.doubts else None


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
    if explanation := _explain_by_field_order(settings, model, start, recording):
        return explanation
    names = recording.rig.names
    with start_foregrounds(recording) as foregrounds:
        mix_ups = find_undecided_mix_ups(recording.rig, list(foregrounds), model, start)
    changes = [_Change(model, mix_up.undo, mix_up=mix_up) for mix_up in mix_ups]
    if len(names) > _FEWEST_CAMERAS:
        changes += [_Change(model, partial(_leave_out, i), camera=name) for i, name in enumerate(names)]
    changes += [_Change(with_size(model, size), size=size) for size in _SIZES]

    def count_tracked(number: int, change: _Change) -> int:
        if progress is not None:
            progress(number, 1 + len(changes))
        changed = [each for each in map(change.undo, first) if each is not None]
        return _count_tracked(_track(settings, change.model, start, changed))

    n = count_tracked(0, _Change(model))
    if _is_most(n):
        return Explanation(
            f"{n} of the first {len(first)} frames are tracked when nothing but them is looked at, with the videos and "
            "cameras as they are: are the body's size and the calibration right, are all videos of this recording, and "
            "are the pictures sharp? Look at the overlay videos where it goes wrong, and give the pose there by a "
            "[[key]]",
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
        "calibration right, and does nothing stand between the cameras and the body?",
        is_mix_up=False,
        is_cause=False,
    )


def _explain_by_field_order(
    settings: Settings, model: BodyModel, start: Pose, recording: Recording
) -> Explanation | None:
    """Say that the fields are in the wrong order, where in the other most are tracked, on a much smoother path."""
    if all(each.fields == "progressive" for each in recording.facts):
        return None
    facts = tuple(replace(each, fields=_OTHER_ORDER[each.fields]) for each in recording.facts)
    tracked = []
    for each in (recording, replace(recording, facts=facts, events=[])):
        with closing(iter(each)) as frames:
            tracked.append(_track(settings, model, start, list(islice(frames, _N_FIELDS))))
    now, other = tracked
    n = _count_tracked(other)
    if 2 * n <= _N_FIELDS or _median_bend_m(other) > _SMOOTHER * _median_bend_m(now):
        return None
    return Explanation(
        f"with the two fields of each picture in the other order, {n} of the first {_N_FIELDS} frames are tracked, and "
        "the body does not go forth and back: correct `fields` under [[camera]]",
        True,
    )


def _track(settings: Settings, model: BodyModel, start: Pose, frames: Sequence[Frames]) -> list[Estimate]:
    return [estimate for _, estimate in track_frames(tracker_of(settings, model, start), frames, lambda _: None)]


def _count_tracked(estimates: Sequence[Estimate]) -> int:
    return sum(estimate.status is Status.TRACKED for estimate in estimates)


def _median_bend_m(estimates: Sequence[Estimate]) -> float:
    """Return the median second difference of the root's positions [m]; infinite where there are none."""
    positions = [each.pose.world_from_root.translation for each in estimates if each.pose is not None]
    bends = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=1) if len(positions) > 2 else np.zeros(0)
    return float(np.median(bends)) if len(bends) else np.inf


def _is_most(n: int) -> bool:
    return 2 * n > _N_FRAMES


def _leave_out(number: int, frames: Frames) -> Frames | None:
    """Return frames without one camera's image; None where it has none."""
    if frames.views[number] is None:
        return None
    return replace(frames, views=tuple(None if i == number else view for i, view in enumerate(frames.views)))
