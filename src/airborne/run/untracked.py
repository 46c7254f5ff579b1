"""A run of a body of which no frame is tracked: which mix-up of its videos would explain that."""

from __future__ import annotations

from contextlib import closing
from itertools import islice

from airborne.body import BodyModel, Pose
from airborne.run.mix_ups import possible_mix_ups
from airborne.tracking import Status
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import track_frames
from airborne.types import Progress
from airborne.video import Recording

# chosen: of so many first frames most must be tracked. Of the example with exchanged or mirrored videos that is each of
# the first frames, and none as they are
_N_FRAMES = 5


def explain_untracked(
    settings: Settings, model: BodyModel, start: Pose, recording: Recording, progress: Progress | None = None
) -> str | None:
    """Say which two cameras' videos, exchanged, or which camera's images, mirrored, would let the body be tracked.

    None where most of the first frames are tracked with no mix-up undone, or with several.
    """
    with closing(iter(recording)) as frames:
        first = list(islice(frames, _N_FRAMES))
    names, found = recording.rig.names, []
    mix_ups = possible_mix_ups(len(names))
    for number, mix_up in enumerate(mix_ups):
        if progress is not None:
            progress(number, len(mix_ups))
        right = [undone for each in first if (undone := mix_up.undo(each)) is not None]
        statuses = [each.status for _, each in track_frames(tracker_of(settings, model, start), right, lambda _: None)]
        found.append((statuses.count(Status.TRACKED), mix_up))
    ranked = sorted(found, key=lambda each: each[0], reverse=True)
    if not ranked or 2 * ranked[0][0] <= _N_FRAMES or (len(ranked) > 1 and ranked[1][0] == ranked[0][0]):
        return None
    n, best = ranked[0]
    what = f"with {best.describe(names)}, {n} of the first {len(first)} frames are tracked"
    return best.finding(names, what).sentence
