"""Errors of a body's landmarks against another system, or the truth."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

import numpy as np

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.evaluation.columns import align_columns
from airborne.evaluation.compare import (
    SdCalibration,
    nan_to_none,
    or_dash,
    sd_calibration,
)
from airborne.evaluation.coverage import Coverage, coverage_of
from airborne.evaluation.joint_files import JointPaths, landmark_of
from airborne.evaluation.mix_ups import Paths, question_mix_up
from airborne.evaluation.times import ELSEWHERE_MM, best_time_shift, match_times, question_shift, span
from airborne.motion import JointStatus, Motion, joint_statuses
from airborne.motion.joints import landmarks_with_frame_sds
from airborne.tracking import Status
from airborne.types import Array, Triple

_CLEARLY_BETTER = 0.98  # of the unshifted distance
_FAR_M = 0.1  # a joint that far off is misplaced


@dataclass(frozen=True, slots=True, kw_only=True)
class JointErrors:
    """Distances of one landmark, or of all, measured minus reference."""

    n: int  # frames, or frames times landmarks
    mean_mm: float
    rms_mm: float
    largest_mm: float
    mean_without_offset_mm: float  # after removing the mean offset in the segment: definitions of a joint differ
    mean_without_bias_mm: float  # after removing the mean offset in the world; both NaN for one frame
    bias_mm: Triple  # mean, world axes
    offset_mm: Triple | None  # mean, the segment's axes; None for all landmarks together


@dataclass(frozen=True, slots=True, kw_only=True)
class JointComparison:
    """A motion's landmarks against a reference, over the frames whose times match and that have a pose."""

    n_frames: int  # of the motion
    n_reference: int
    n_matched: int
    n_tracked: int  # of the matched frames, like the next two
    n_uncertain: int
    n_lost: int
    largest_time_offset_s: float
    joints: dict[str, JointErrors]  # by landmark
    whole: JointErrors  # its mean is the mean per-joint position error (MPJPE)
    tracked: JointErrors | None  # the same over the joints whose own status is tracked; None where there are none
    share_tracked: float  # of the joints in the frames compared
    n_far: int  # joints whose own status is tracked and that are more than 100 mm off
    not_compared: tuple[str, ...]  # markers without a landmark, and landmarks without a marker
    calibration: SdCalibration  # errors against the landmarks' reported deviations
    coverage_with_offset: Coverage  # of those errors
    coverage: Coverage  # the same without each landmark's constant offset in its segment
    coverage_by_frame: Coverage  # of those errors by the deviations of what changes from frame to frame
    better_shift_s: float  # added to the reference's times, this would clearly agree better; whole periods, or 0
    better_mean_without_offset_mm: float  # the error with that shift
    mix_up: str  # a question about unit, axes, sides or times where these explain why the reference is far; else ""

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return nan_to_none(asdict(self) | {"questions": list(self.questions)})

    @property
    def questions(self) -> tuple[str, ...]:
        """What is asked about the reference where it is far from the landmarks, one line each."""
        if self.mix_up:
            return (self.mix_up,)
        if self.better_shift_s:
            then = f"'no offset' would be {self.better_mean_without_offset_mm:.1f} mm"
            return (question_shift(self.better_shift_s, "reference", then),)
        if min(self.whole.mean_without_offset_mm, self.whole.mean_without_bias_mm) > ELSEWHERE_MM:
            return ("the paths are nowhere near these joints: are they of this recording?",)
        if self.whole.mean_mm > ELSEWHERE_MM > self.whole.mean_without_bias_mm:
            return (
                f"less a constant shift in the world the mean would be {self.whole.mean_without_bias_mm:.0f} mm, not "
                f"{self.whole.mean_mm:.0f} mm: is the reference's origin that of the run's world?",
            )
        return ()

    def describe(self) -> str:
        """Return the numbers as a short plain table."""
        lines = [
            f"{self.n_matched} of {self.n_reference} reference times matched, at most "
            f"{1e3 * self.largest_time_offset_s:.1f} ms off: "
            f"{self.n_tracked} tracked, {self.n_uncertain} uncertain, {self.n_lost} lost",
        ]
        rows = {**self.joints, "all": self.whole} | ({"all, tracked": self.tracked} if self.tracked else {})
        table: list[tuple[str, ...]] = [("joint [mm]", "mean", "RMS", "max", "no offset")]
        for name, e in rows.items():
            numbers = (e.mean_mm, e.rms_mm, e.largest_mm, e.mean_without_offset_mm)
            table.append((f"  {name}", *(or_dash(number, ".1f") for number in numbers)))
        lines += align_columns(table, (18, 9, 9, 9, 11))
        lines.append("no offset: the mean without a constant offset in the segment, as between two definitions")
        share = self.calibration
        if share.n:
            lines.append(
                f"errors within 1 sd {share.within_1sd:.0%} (normal: 68%), "
                f"within 2 sd {share.within_2sd:.0%} (95%), n = {share.n}"
            )
        if self.coverage.n:
            lines.append(self.coverage_with_offset.describe("errors"))
            lines.append(self.coverage.describe("errors without offset"))
        if self.coverage_by_frame.n:
            by_frame = self.coverage_by_frame.describe("errors without offset")
            lines.append(f"by deviations of what changes from frame to frame: {by_frame}")
        lines.append(f"joints tracked: {self.share_tracked:.0%}; of these more than 100 mm off: {self.n_far}")
        if self.not_compared:
            lines.append(f"not compared: {', '.join(self.not_compared)}")
        return "\n".join([*lines, *self.questions])


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Landmarks beside their reference, both (n, l, 3) [m], and the rotations of their segments (n, l, 3, 3)."""

    measured: Array
    reference: Array
    R: Array

    @property
    def error(self) -> Array:
        return self.measured - self.reference


def compare_joints(
    motion: Motion, model: BodyModel, reference: JointPaths, smooth: JointPaths | None = None
) -> JointComparison:
    """Compare a motion's landmarks with a reference, frame by frame, matched as in `compare_motion`.

    A marker is matched with the landmark of its name, or else that of `landmark_of`. With `smooth`, the motion's
    landmarks as they were smoothed take the places of its own, and their deviations. Raises ResultError if no marker
    has a landmark, no frame with a pose has a reference, or `smooth` is not of the motion.
    """
    marker_columns, not_compared = _match_markers(model, reference)
    columns = [k for k, mark in enumerate(model.landmarks) if mark.name in marker_columns]
    names = [model.landmarks[k].name for k in columns]
    reference = replace(reference, points=reference.points[:, [marker_columns[name] for name in names]])
    frames, rows, offset = match_times(motion.time_s, reference.time_s)
    status = motion.status[frames]
    has_pose = motion.has_pose[frames]
    if not has_pose.any():
        raise ResultError(
            f"no pose to compare: motion {span(motion.time_s)} with {int(motion.has_pose.sum())} poses, "
            f"reference {span(reference.time_s)}; give the joints of this recording"
        )
    points, all_sd, sd_by_frame = landmarks_with_frame_sds(motion, model)
    joint_status = joint_statuses(motion, model, all_sd)[:, columns]
    measured, sd = points[:, columns], all_sd[:, columns]
    sd_by_frame = sd_by_frame[:, columns]
    if smooth is not None:
        measured, sd = _match_smooth(motion, smooth, names)
        sd_by_frame = np.full(sd.shape, np.nan)  # they are not told apart
    R = _rotations(motion, model, columns)
    frames, rows = frames[has_pose], rows[has_pose]
    pairs = _Pairs(measured[frames], reference.points[rows], R[frames])
    is_known = np.asarray(np.isfinite(pairs.error).all(axis=-1))
    if not is_known.any():
        raise ResultError("the reference has no number where the motion has a pose; give the joints of this recording")
    joints = {name: _errors(pairs, [k]) for k, name in enumerate(names) if is_known[:, k].any()}
    is_tracked = (joint_status[frames] == JointStatus.TRACKED.value) & is_known
    tracked = replace(pairs, measured=np.where(is_tracked[..., None], pairs.measured, np.nan))
    everything = list(range(len(names)))
    whole = _errors(pairs, everything)

    def mean_at(shift_s: float) -> tuple[float, int]:
        frames, rows, _ = match_times(motion.time_s, reference.time_s + shift_s)
        local = np.einsum("nlji,nlj->nli", R[frames], measured[frames] - reference.points[rows])
        return _mean_about(local), int(np.isfinite(local).all(axis=-1).sum())

    shift_s, shifted_mm = best_time_shift(reference.time_s, whole.mean_without_offset_mm, mean_at, _CLEARLY_BETTER)
    return JointComparison(
        n_frames=len(motion),
        n_reference=len(reference.time_s),
        n_matched=len(status),
        n_tracked=int(np.sum(status == Status.TRACKED.value)),
        n_uncertain=int(np.sum(status == Status.UNCERTAIN.value)),
        n_lost=int(np.sum(status == Status.LOST.value)),
        largest_time_offset_s=float(offset[has_pose].max()),
        joints=joints,
        whole=whole,
        tracked=_errors(tracked, everything) if is_tracked.any() else None,
        share_tracked=float(is_tracked.sum() / is_known.sum()),
        n_far=int(np.sum(np.linalg.norm(tracked.error, axis=-1) > _FAR_M)),
        not_compared=(*not_compared, *(name for name in names if name not in joints)),
        calibration=sd_calibration(pairs.error[is_known], np.repeat(sd[frames][is_known][:, None], 3, axis=1)),
        coverage_with_offset=coverage_of(pairs.error, np.repeat(sd[frames][..., None], 3, axis=2)),
        coverage=_coverage(pairs, sd[frames]),
        coverage_by_frame=_coverage(pairs, sd_by_frame[frames]),
        better_shift_s=shift_s,
        better_mean_without_offset_mm=shifted_mm,
        mix_up=question_mix_up(Paths(motion.time_s, measured), Paths(reference.time_s, reference.points), names),
    )


def _match_smooth(motion: Motion, smooth: JointPaths, names: list[str]) -> tuple[Array, Array]:
    """Return the smoothed landmarks of these names in the motion's frames, and their sds: (n, l, 3), (n, l) [m]."""
    if len(smooth.time_s) != len(motion) or np.any(smooth.time_s != motion.time_s) or not set(names) <= {*smooth.names}:
        raise ResultError("the smoothed joints are of another run; `airborne smooth` this one again")
    columns = [smooth.names.index(name) for name in names]
    sd = np.full((len(motion), len(names)), np.nan) if smooth.sd is None else smooth.sd[:, columns]
    return smooth.points[:, columns], sd


def _match_markers(model: BodyModel, reference: JointPaths) -> tuple[dict[str, int], list[str]]:
    """Return the reference's column for each landmark that has one, and the unmatched names."""
    names = [landmark.name for landmark in model.landmarks]
    columns = {name: k for k, name in enumerate(reference.names) if name in names}
    for k, marker in enumerate(reference.names):
        name = landmark_of(marker)
        if name in names:
            columns.setdefault(name, k)
    if not columns:
        raise ResultError(
            f"no joint in common: the reference has {', '.join(reference.names[:4])}, ..., "
            f"body '{model.name}' has {', '.join(names[:4])}, ...; name the columns by the body's landmarks"
        )
    used = set(columns.values())
    unmatched = [marker for k, marker in enumerate(reference.names) if k not in used]
    return columns, unmatched + [name for name in names if name not in columns]


def _rotations(motion: Motion, model: BodyModel, columns: list[int]) -> Array:
    """Return the world rotations of the landmarks' segments: (n, landmarks, 3, 3)."""
    owners = model.landmark_segments[columns]
    R = np.full((len(motion), len(owners), 3, 3), np.nan)
    for row in np.flatnonzero(motion.has_pose):
        R[row] = model.with_pose(motion.pose(row)).R[owners]
    return R


def _errors(pairs: _Pairs, columns: list[int]) -> JointErrors:
    """Reduce the errors of some landmarks; offsets are each landmark's own."""
    error = pairs.error[:, columns]
    local = np.einsum("nlji,nlj->nli", pairs.R[:, columns], error)
    is_known = np.isfinite(error).all(axis=-1)
    distance = np.linalg.norm(error[is_known], axis=-1)
    in_mm = 1e3 * distance
    return JointErrors(
        n=len(distance),
        mean_mm=float(in_mm.mean()),
        rms_mm=float(np.sqrt(np.mean(in_mm**2))),
        largest_mm=float(in_mm.max()),
        mean_without_offset_mm=_mean_about(local),
        mean_without_bias_mm=_mean_about(error),
        bias_mm=_triple(1e3 * error[is_known].mean(axis=0)),
        offset_mm=_triple(1e3 * local[is_known].mean(axis=0)) if len(columns) == 1 else None,
    )


def _coverage(pairs: _Pairs, sd: Array) -> Coverage:
    """Count the errors in the segments' axes, less each landmark's mean, by their deviations (n, l) [m]."""
    local = np.einsum("nlji,nlj->nli", pairs.R, pairs.error)
    n = np.isfinite(local).all(axis=-1, keepdims=True).sum(axis=0)
    return coverage_of(local - np.nansum(local, axis=0) / np.maximum(n, 1), np.repeat(sd[..., None], 3, axis=2))


def _mean_about(error: Array) -> float:
    """Return the mean distance [mm] of errors (n, l, 3) from each landmark's own mean; NaN for single frames."""
    n = np.isfinite(error).all(axis=-1).sum(axis=0)
    error = error[:, n > 1]
    if not error.size:
        return math.nan
    return float(1e3 * np.nanmean(np.linalg.norm(error - np.nanmean(error, axis=0), axis=-1)))


def _triple(values: Array) -> Triple:
    x, y, z = values.tolist()
    return x, y, z
