"""summary.json: the headline numbers of a run, in one dictionary that the report prints too."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from airborne.errors import count, count_of
from airborne.io.writing import replace_text
from airborne.motion import JointStatus, Motion, root_angles
from airborne.tracking import Doubt, Status
from airborne.types import Array

_REASONS = {
    Doubt.IMAGES: "images and pose agree too little",
    Doubt.POSITION: "a position has an sd over 50 mm",
    Doubt.VIEW: "much of the body is out of the pictures",
    Doubt.LIMBS: "limbs may be misplaced, before anything was learned from this recording",
    Doubt.DIRECTIONS: "tracked forward and back in time the body was in different places",
    Doubt.SELF_CHECK: "the self-check doubts it",
}


MOST_UNTRACKED = 0.5  # chosen: most of what is said of a run of which less is tracked rests on the other frames
_HARDLY_ANY = 0.1  # chosen: so few of several frames are tracked that a run says nothing
_MUCH_LATER = 0.02  # chosen: share of a run by which its turns begin later or end earlier, from which on it is said


def headline(motion: Motion) -> dict[str, Any]:
    """Reduce a motion to its headline numbers; unknown ones are NaN or infinite.

    - `n_frames`, `n_tracked`, `n_uncertain`, `n_lost`; `start_s`, `duration_s` (first to last frame), `rate_hz`
    - `doubts`: how many frames are uncertain for each reason
    - `median_score` [grey levels]
    - `median_position_sd_mm`, `median_rotation_sd_deg`: of each frame's root mean square over the three axes;
      infinite where most frames do not show some direction
    - `range_m`: largest minus smallest x, y, z; `tilt_range_deg`: smallest and largest
    - `somersault_rev`, `twist_rev`: revolutions from the first to the last frame with a pose whose angles have an sd;
      of any poses where fewer than two have; `somersault_rev_sd`, `twist_rev_sd`: of both ends together
    - `turns_s`: the times of these ends; a single pose has no turns
    - `n_position_unobservable`, `n_rotation_unobservable`: frames with an infinite variance
    - `n_near_singular`: frames within 5 degrees of 90 degrees of tilt
    - `has_gap`: lost frames lie between frames with a pose, so that whole revolutions may be miscounted
    """
    has_pose = motion.has_pose
    rows = np.flatnonzero(has_pose)
    angles = root_angles(motion)
    somersault, tilt, twist = angles.deg[has_pose].T
    somersault_sd, _, twist_sd = angles.sd_deg[has_pose].T
    ends_of_turns = _known_ends(somersault_sd, twist_sd)
    position_sd, rotation_sd = motion.position_sd[has_pose], motion.rotation_sd[has_pose]
    ends = motion.time_s[[0, -1]] if len(motion) else np.full(2, np.nan)
    return {
        "n_frames": len(motion),
        "n_tracked": motion.count(Status.TRACKED),
        "n_uncertain": motion.count(Status.UNCERTAIN),
        "n_lost": motion.count(Status.LOST),
        "doubts": motion.count_doubts(),
        "start_s": float(ends[0]),
        "duration_s": float(ends[1] - ends[0]),
        "rate_hz": round(1 / float(np.median(np.diff(motion.time_s))), 6) if len(motion) > 1 else math.nan,
        "median_score": _median(motion.score[has_pose]),
        "median_position_sd_mm": 1e3 * _median(_rms_over_axes(position_sd)),
        "median_rotation_sd_deg": math.degrees(_median(_rms_over_axes(rotation_sd))),
        "range_m": np.ptp(motion.position[has_pose], axis=0).tolist() if len(rows) else [math.nan] * 3,
        "turns_s": motion.time_s[has_pose][ends_of_turns].tolist() or [math.nan] * 2,
        "somersault_rev": _revolutions(somersault[ends_of_turns]),
        "somersault_rev_sd": _of_both_ends(somersault_sd[ends_of_turns]),
        "tilt_range_deg": [float(tilt.min()), float(tilt.max())] if len(rows) else [math.nan] * 2,
        "twist_rev": _revolutions(twist[ends_of_turns]),
        "twist_rev_sd": _of_both_ends(twist_sd[ends_of_turns]),
        "n_position_unobservable": int(np.isinf(position_sd).any(axis=1).sum()),
        "n_rotation_unobservable": int(np.isinf(rotation_sd).any(axis=1).sum()),
        "n_near_singular": int(angles.is_singular[rows].sum()),
        "has_gap": bool(len(rows) and rows[-1] - rows[0] + 1 > len(rows)),
    }


def is_mostly_untracked(head: Mapping[str, Any]) -> bool:
    """Whether less than half of a run's frames are tracked, so that nothing can be said of it as a whole.

    Of players that is said of the one who is tracked best.
    """
    return bool(count_tracked(head) < MOST_UNTRACKED * head["n_frames"])


def is_hardly_tracked(head: Mapping[str, Any]) -> bool:
    """Whether of several frames a tenth or less are tracked, so that the run says nothing."""
    return head["n_frames"] > 1 and bool(count_tracked(head) <= _HARDLY_ANY * head["n_frames"])


def count_tracked(head: Mapping[str, Any]) -> int:
    """Return in how many frames the body is tracked, or the player who is tracked best."""
    return max((each["n_tracked"] for each in head.get("players", {}).values()), default=head["n_tracked"])


def describe_lost(n_lost: int, n_frames: int) -> str:
    """Say how many of a run's frames are lost."""
    return f"{count_of(n_lost, n_frames, 'frame')} lost; {'it holds' if n_lost == 1 else 'they hold'} no numbers"


def body_warnings(head: Mapping[str, Any]) -> Iterator[str]:
    """Yield, in plain sentences, what the reader of a `headline` must not miss; nothing if every frame is tracked."""
    n, n_posed = head["n_frames"], head["n_tracked"] + head["n_uncertain"]
    if not n_posed:
        yield "The body was found in no frame: this run measured nothing."
    elif head["n_lost"]:
        yield f"{describe_lost(head['n_lost'], n)}."
    if n > 1 and n_posed and not head["n_tracked"]:
        yield "No frame was tracked: none of these numbers can be relied on."
    elif is_mostly_untracked(head):
        yield (
            f"Only {count_of(head['n_tracked'], n, 'frame')} tracked: turns, ranges and whatever else is said of the "
            "whole run rest on uncertain frames."
        )
    if head["n_uncertain"]:
        why = f": {describe_doubts(head)}" if head["doubts"] else ""
        uncertain = count_of(head["n_uncertain"], n, "frame")
        yield f"{uncertain} uncertain{why}; look at them in the overlay videos before use."
    for what in ("position", "rotation"):
        if head[f"n_{what}_unobservable"]:
            yield (
                f"In {head[f'n_{what}_unobservable']} of {n_posed} frames with a pose, some direction of the {what} "
                "cannot be seen in the images: its standard deviation is infinite, and its number is only a guess."
            )
        elif n_posed and head[f"median_{what}_sd_{'mm' if what == 'position' else 'deg'}"] is None:
            yield f"The uncertainty of the {what} is not known."
    if head["n_near_singular"]:
        yield (
            f"In {head['n_near_singular']} frames tilt is within 5° of ±90°: somersault and twist mean little there, "
            "and their numbers of turns may be miscounted. The quaternions are sound."
        )
    turns_s = head["turns_s"]
    if turns_s[0] is not None:
        late, early = turns_s[0] - head["start_s"], head["start_s"] + head["duration_s"] - turns_s[1]
        if max(late, early) > _MUCH_LATER * head["duration_s"] and not head["n_lost"]:
            yield (
                f"Somersault and twist are counted from {turns_s[0]:.2f} to {turns_s[1]:.2f} s: at the ends of the run "
                "the pictures do not show them."
            )
    if head["has_gap"]:
        yield (
            "Somersault and twist were counted across lost frames, at the rate before them: they may be off by whole "
            "turns."
        )


def describe_doubts(head: Mapping[str, Any]) -> str:
    """Say why frames are uncertain, and how many for each reason; empty where none is."""
    return ", ".join(f"{_REASONS[Doubt(doubt)]} ({n})" for doubt, n in head["doubts"].items())


def joint_warnings(statuses: Mapping[str, Mapping[str, int]]) -> Iterator[str]:
    """Yield how far the joints of a run can be trusted, by the counts of `count_statuses`; nothing if all are."""
    sums = {status: sum(of_joint[status] for of_joint in statuses.values()) for status in JointStatus}
    total = sum(sums.values())
    if sums[JointStatus.TRACKED] < total:
        worst = min(statuses, key=lambda joint: statuses[joint][JointStatus.TRACKED])
        n_tracked, n_frames = statuses[worst][JointStatus.TRACKED], sum(statuses[worst].values())
        counts = ", ".join(f"{n} {status}" for status, n in sums.items())
        yield (
            f"{count(total, 'joint position')}: {counts}; the fewest tracked are those of {worst}, {n_tracked} of "
            f"{count(n_frames, 'frame')}; joints.csv has the status of each"
        )


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write a dictionary as JSON; NaN and infinite numbers become null. The file appears whole or not at all."""
    text = json.dumps(json_ready(values), indent=2, ensure_ascii=False, allow_nan=False)
    replace_text(path, text + "\n")


def json_ready(value: Any) -> Any:
    """Convert arrays, fractions and paths to JSON types, recursively; NaN and infinite become None."""
    if isinstance(value, Mapping):
        return {str(key): json_ready(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_ready(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return json_ready(value.tolist())
    if isinstance(value, Fraction):
        return float(value)
    if isinstance(value, Path):
        return str(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _rms_over_axes(sd: Array) -> Array:
    return np.sqrt(np.mean(sd**2, axis=1))


def _median(values: Array) -> float:
    present = values[~np.isnan(values)]
    return float(np.median(present)) if len(present) else math.nan


def _known_ends(*sd_deg: Array) -> list[int]:
    """Return the first and last place at which all these are known; of all where fewer than two are, none of one."""
    known = np.flatnonzero(np.isfinite(sd_deg).all(axis=0))
    places = known if len(known) > 1 else np.arange(len(sd_deg[0]))
    return places[[0, -1]].tolist() if len(places) > 1 else []


def _of_both_ends(sd_deg: Array) -> float:
    return float(np.hypot(sd_deg[0], sd_deg[-1])) / 360 if len(sd_deg) > 1 else math.nan


def _revolutions(angle_deg: Array) -> float:
    return float(angle_deg[-1] - angle_deg[0]) / 360 if len(angle_deg) else math.nan
