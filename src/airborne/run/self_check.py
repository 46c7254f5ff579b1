"""The self-check of a run of one body: lasting errors and statuses for its motion, findings for its summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.cameras import Rig
from airborne.constants import GRAVITY_M_S2
from airborne.errors import count_of
from airborne.motion import Motion
from airborne.tracking import Doubt, Status
from airborne.tracking.first_pose import FirstPose
from airborne.tracking.first_pose.body_size import WrongSize
from airborne.tracking.model_based.status import UNCERTAIN_SD_M
from airborne.tracking.self_check.check import SelfCheck, doubts, gather_equations, self_check
from airborne.tracking.self_check.free_flight import WrongFall, fall, find_wrong_flight
from airborne.tracking.self_check.kept_frames import KeptFrames
from airborne.tracking.self_check.nuisances import MEASURED_SD, ONE_CAMERA_SD, PRESET_SD, columns_of
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.reach import FarReach, doubtful_joints, find_far_reach
from airborne.tracking.self_check.roughness import PathFinding, find_wrong_path, measure_roughness
from airborne.tracking.self_check.strays import find_strays
from airborne.types import Array

# of the sizes of body and world, chosen: at a rate 10 % too low those of a throw were 23.2 and 23.4 %
_ALIKE = 0.1
_CLEARLY_ROUGH = 1.5  # chosen: a factor on standard deviations from which on it is said
# of the frames, by tracking alone. Chosen between the starts by 12 points of one recorded person: the right ones left 3
# of 32 frames in doubt, with left and right exchanged they left 14
_DOUBTFUL_SHARE = 0.25
# times the run's median score, of first frames or of frames that fewer cameras show. Chosen: 40 runs of a thing, right
# ones and with mistakes of all kinds, began with 0.8 to 1.24; one that began turned by half, and found itself in the
# third frame, with 2.5; one that a camera alone showed, 0.6 m off, had 2
_UNLIKE_SHARE = 1.6
_UNLIKE = "at its start the body looks less like the pictures than later: is the start turned, or of another frame?"
_UNLIKE_IN_FEWER = "fewer cameras see the body there than elsewhere, and it looks less like their pictures"
_STRAY = (
    "the body leaves the path of the frames around, and looks less like the pictures than in these: are pictures "
    "repeated or lost, or a camera late for a while?"
)
_EITHER_WAY = (
    "left and right may be exchanged in the start's points, which fit as well the other way; add the toes' tips"
)
_REMEDIES = {  # by the kind of a finding that is an alarm
    "time_s": ": run `airborne sync`, then track again",
    "drift_s": "; write it anew with the rate at which it was filmed, then track again",
}
_SIZE_OF_ONE_VIEW = (
    "self-check: to one camera only a free fall shows how large a body is, {measured}: distances are as right as the "
    "sizes in the body's file"
)
_NO_FALL = "self-check: no free fall was measured, so that a wrong frame rate would not be noticed"
_NEVER_EMPTY = "self-check: the scene is never seen without the body, so nothing can be said; film a moment without it"


@dataclass(frozen=True, slots=True, eq=False)
class CheckedRun:
    """A finished run after its self-check."""

    motion: Motion  # with lasting errors and those of a rough path, doubtful frames uncertain
    found: SelfCheck | None  # None: too little to say anything
    doubts: tuple[str, ...]  # sentences
    wrong: Sequence[WrongFall | PathFinding | WrongSize | FarReach] = ()  # what no camera or clock explains
    is_start_wrong: bool = False  # by its own landmarks
    doubtful_joints: NDArray[np.bool_] | None = None  # (joints,) of limbs for which the body is too small

    def doubt_joints(self, motion: Motion) -> Motion:
        """Return its motion, or what was fitted to the whole run, with the doubtful joints uncertain in all frames."""
        if self.doubtful_joints is None:
            return motion
        return replace(motion, uncertain_joints=motion.uncertain_joints | self.doubtful_joints)

    @property
    def findings(self) -> list[dict[str, Any]]:
        """What summary.json holds."""
        causes = () if self.found is None else self.found.diagnosis.findings
        wrong = [finding.to_dict() for finding in self.wrong]
        said = {(each["subject"], each["kind"]) for each in wrong}
        return [*wrong, *(each.to_dict() for each in causes if (each.subject, each.kind) not in said)]


def check_run(
    motion: Motion,
    model: BodyModel,
    rig: Rig,
    kept: KeptFrames,
    *,
    is_preset: bool,
    first: FirstPose | None = None,
) -> CheckedRun:
    """Check a finished run by some of its frames, in the order in which they were tracked, and by its first pose."""
    rows, begun = np.flatnonzero(motion.has_pose), next(iter(kept), None)
    if not len(rows) or begun is None:
        return CheckedRun(motion, None, ())
    frames = sorted(kept, key=lambda each: each.index)
    poses = [motion.pose(row) for row in rows]
    path = TrackedPath(motion.index[rows], motion.time_s[rows], poses, motion.covariance[rows, :6, :6])
    rough = np.ones(2) if model.has_joints else measure_roughness(path, motion.status[rows] == Status.TRACKED.value)
    excess = np.zeros((len(motion), 6, 6))
    excess[rows] = _excess(path.covariance, rough)
    of_path = None if model.has_joints else find_wrong_path(path, rough)
    path = replace(path, covariance=path.covariance + excess[rows])
    is_of_one_view = len(rig) == 1 and not model.has_joints
    body_sd = ONE_CAMERA_SD if is_of_one_view else PRESET_SD if is_preset else MEASURED_SD
    run = gather_equations(model, rig, path, frames, body_sd=body_sd)
    found = None if run is None else self_check(run, model, rig, path)
    status, doubted, sentences = motion.status.astype(object), motion.doubts.astype(object), []
    wrong: list[WrongFall | PathFinding | WrongSize | FarReach] = []
    reasons = doubts(model, path, frames, begun.index, found)
    is_start_wrong = first is not None and bool(first.wrong_size or first.exchange)
    if first is not None and is_start_wrong:
        wrong += [first.wrong_size] if first.wrong_size else []
        reasons[first.exchange or "the body is not as large as the landmarks of its start say"] = np.ones(
            len(rows), bool
        )
    is_doubtful = np.mean(motion.status != Status.TRACKED.value) > _DOUBTFUL_SHARE
    if first is not None and first.ambiguity and is_doubtful:
        reasons[_EITHER_WAY] = np.ones(len(rows), bool)
    far = None if run is None or not model.has_joints else find_far_reach(model, run.reach)
    wrong += [] if far is None else [far]
    if not model.has_joints:
        scores, n_views = motion.score[rows], motion.n_views[rows]
        is_unlike = look_unlike(scores)
        begins = int(np.argmin(np.abs(path.index - begun.index)))
        reasons[_UNLIKE] = np.append(np.zeros(begins, bool), np.logical_and.accumulate(is_unlike[begins:]))
        reasons[_UNLIKE_IN_FEWER] = is_unlike & (n_views < n_views.max())
        reasons[_STRAY] = find_strays(path, scores)
        flight = path.time_s, path.positions, path.rotations, path.covariance[:, :3, :3]
        of_flight = find_wrong_flight(*flight)
        wrong += [each for each in (of_path, of_flight) if each is not None]
        is_measured = of_flight is not None or fall(*flight) is not None
        if of_flight is None and len(rig) == 1 and found is not None:
            size = columns_of(rig)["body", "scale"]
            sd = np.sqrt(found.diagnosis.covariance[size, size]).item()
            measured = f"here to {100 * sd:.1f} %" if is_measured else "and none was measured"
            sentences.append(_SIZE_OF_ONE_VIEW.format(measured=measured))
        if not is_measured and len(motion) > 1:
            sentences.append(_NO_FALL)
        if of_path is not None and of_path.kind == "repeated":
            reasons = {**reasons, "pictures show the moment of the one before": np.ones(len(rows), bool)}
    if found is None and len(motion) > 1:
        sentences.append(_NEVER_EMPTY)
    for reason, is_doubtful in reasons.items():
        doubtful = rows[is_doubtful & (motion.status[rows] == Status.TRACKED.value)]
        status[doubtful], doubted[doubtful] = Status.UNCERTAIN.value, Doubt.SELF_CHECK.value
        if len(doubtful):
            sentences.append(f"self-check: {count_of(len(doubtful), len(motion), 'frame')} uncertain: {reason}")
    is_wide = (np.diagonal(path.covariance[:, :3, :3], axis1=1, axis2=2) > UNCERTAIN_SD_M**2).any(axis=1)
    wide = rows[is_wide & (status[rows] == Status.TRACKED.value) & (rough.max() > 1)]
    status[wide], doubted[wide] = Status.UNCERTAIN.value, Doubt.POSITION.value
    if rough.max() > _CLEARLY_ROUGH and (of_path is None or of_path.kind != "roughness"):
        position, rotation = rough
        sentences.append(
            f"self-check: from frame to frame positions scatter {position:.1f} times and rotations {rotation:.1f} "
            "times as much as stated errors explain, so that their standard deviations are multiplied by that"
        )
    lasting = None if found is None else found.lasting_at(motion.index)
    if rough.max() > 1:  # beside what the frames say themselves, which a run that is resumed keeps
        lasting = excess if lasting is None else lasting + excess
    checked = replace(motion, status=status.astype(np.str_), doubts=doubted.astype(np.str_))
    checked = replace(checked, lasting=lasting, by_frame=None)  # what is beside the table may be of an end before
    doubtful = None if far is None else doubtful_joints(model, far)
    return CheckedRun(checked, found, tuple(sentences), wrong, is_start_wrong, doubtful)


def look_unlike(scores: Array) -> NDArray[np.bool_]:
    """Tell which frames look unlike the pictures, by scores (n,) of a whole run: (n,)."""
    is_known = np.isfinite(scores)
    return is_known & (scores > _UNLIKE_SHARE * np.median(scores[is_known] if is_known.any() else 0.0))


def widen_by_fall(motion: Motion, fall: WrongFall) -> Motion:
    """Return a motion with the errors of a world as much too large as its fall says; frames with wide ones uncertain.

    A world is too large about its origin, so that positions err by as large a share of their distances from there.
    """
    variance = (fall.gravity_m_s2 / GRAVITY_M_S2 - 1) ** 2 * np.sum(motion.position**2, axis=1)
    lasting = np.zeros((len(motion), 6, 6)) if motion.lasting is None else motion.lasting.copy()
    lasting[:, range(3), range(3)] += np.nan_to_num(variance)[:, None]
    is_wide = (variance > UNCERTAIN_SD_M**2) & (motion.status == Status.TRACKED.value)
    return replace(
        motion,
        lasting=lasting,
        status=np.where(is_wide, Status.UNCERTAIN.value, motion.status),
        doubts=np.where(is_wide, Doubt.POSITION.value, motion.doubts),
    )


def _excess(covariance: Array, rough: Array) -> Array:
    """Return what factors (2,) on the errors of position and rotation add to covariances (n, 6, 6); 0 where unknown."""
    factors = np.repeat(rough, 3)
    more = np.outer(factors, factors) - 1
    added = np.multiply(covariance, more, out=np.zeros_like(covariance), where=more > 0)
    return np.where(np.isnan(added), 0.0, added)


def alarms(findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the sentences of what is wrong.

    A fall tells the size of the body and the world by the frame rate: one that is wrong makes both wrong alike.
    """
    wrong = [finding for finding in findings if finding["is_alarm"]]
    said = [f"self-check: {finding['sentence']}{_REMEDIES.get(finding['kind'], '')}" for finding in wrong]
    sizes = {finding["subject"]: finding["value"] for finding in wrong if finding["kind"] == "scale"}
    body, world = sizes.get("body", 0.0), sizes.get("world", 0.0)
    if abs(body - world) < _ALIKE * abs(body):
        off = 1 - 1 / np.sqrt(1 + (body + world) / 2)
        said.append(
            f"self-check: a frame rate {abs(100 * off):.0f} % too {'low' if off > 0 else 'high'} would explain both"
        )
    return said
