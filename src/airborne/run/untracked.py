"""A run of a body of which no frame is tracked: which mix-up of its videos, or which camera, would explain that."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import NamedTuple

from airborne.body import BodyModel, Pose
from airborne.run.mix_ups import possible_mix_ups
from airborne.tracking import Status
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import track_frames
from airborne.types import Progress
from airborne.video import Frames, Recording

# chosen: of so many first frames most must be tracked. Of the example with exchanged or mirrored videos that is each of
# the first frames, and none as they are
_N_FRAMES = 5
_FEWEST_CAMERAS = 2  # that locate a body when one is left out


class Explanation(NamedTuple):
    """What would let the first frames of a run be tracked, if anything was found."""

    sentence: str
    is_mix_up: bool  # videos are not those of their cameras, of which the self-check then says nothing right


def explain_untracked(
    settings: Settings, model: BodyModel, start: Pose, recording: Recording, progress: Progress | None = None
) -> Explanation:
    """Say which cameras' videos, exchanged or mirrored, or else which camera, left out, would let the body be tracked.

    One is named where it alone lets most of the first frames be tracked.
    """
    with closing(iter(recording)) as frames:
        first = list(islice(frames, _N_FRAMES))
    names = recording.rig.names
    mix_ups = possible_mix_ups(len(names))
    left_out = [partial(_leave_out, i) for i in range(len(names))] if len(names) > _FEWEST_CAMERAS else []
    n_all = len(mix_ups) + len(left_out)

    def track_changed(changes: Sequence[Callable[[Frames], Frames | None]], n_before: int) -> tuple[int, int] | None:
        """Return which change alone lets most frames be tracked, and how many."""
        counts = []
        for number, change in enumerate(changes):
            if progress is not None:
                progress(n_before + number, n_all)
            changed = [each for each in map(change, first) if each is not None]
            tracked = track_frames(tracker_of(settings, model, start), changed, lambda _: None)
            counts.append(sum(estimate.status is Status.TRACKED for _, estimate in tracked))
        most = max(counts, default=0)
        return (counts.index(most), most) if 2 * most > _N_FRAMES and counts.count(most) == 1 else None

    as_mixed_up, without = track_changed([mix_up.undo for mix_up in mix_ups], 0), track_changed(left_out, len(mix_ups))
    if as_mixed_up and (without is None or as_mixed_up[1] >= without[1]):
        mix_up, n = mix_ups[as_mixed_up[0]], as_mixed_up[1]
        what = f"with {mix_up.describe(names)}, {n} of the first {len(first)} frames are tracked"
        return Explanation(mix_up.finding(names, what).sentence, True)
    if without:
        return Explanation(
            f"without {names[without[0]]}, {without[1]} of the first {len(first)} frames are tracked: was it moved, or "
            "calibrated wrongly, or is its clock off? Calibrate it again, or leave it out (--cameras)",
            False,
        )
    tried = "exchanged or mirrored" + (", nor with one camera left out" if left_out else "")
    return Explanation(
        f"the first frames are not tracked either with videos {tried}: are [start] and the body's size right?", False
    )


def _leave_out(number: int, frames: Frames) -> Frames | None:
    """Return frames without one camera's image; None where it has none."""
    if frames.views[number] is None:
        return None
    return replace(frames, views=tuple(None if i == number else view for i, view in enumerate(frames.views)))
