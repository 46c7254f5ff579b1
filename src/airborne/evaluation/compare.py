"""Errors of a measured motion against the true one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.errors import ResultError, count
from airborne.evaluation.columns import align_columns
from airborne.evaluation.mix_ups import Paths, question_mix_up
from airborne.evaluation.times import CLEARLY_BETTER, best_time_shift, match_times, question_shift, span
from airborne.evaluation.truth import Truth
from airborne.geometry.rotations import angles_from_matrix, geodesic, is_near_singular, wrap
from airborne.motion import Motion
from airborne.tracking import Status
from airborne.types import Array, Triple

_HARDLY_ANY = 0.2  # share within two sds; 0.95 is expected
_ANOTHER = "is this the reference of this recording, in its world"
_TRANSPOSED = "do r00..r22 turn the body's axes into the world's, row by row, and not the other way, transposed"
_TRANSPOSED_NEARER = 0.25  # chosen: share of the angle that transposed rotations leave at most
_OTHER_WAY = 10.0  # times nearer once turned to what looks the same: no noise does that


@dataclass(frozen=True, slots=True)
class PositionErrors:
    """Errors of the root's position: x, y, z, and the distance in space."""

    rms_mm: Triple
    largest_mm: Triple
    rms_3d_mm: float
    largest_3d_mm: float


@dataclass(frozen=True, slots=True)
class OrientationErrors:
    """Errors of somersault, tilt and twist, and of the whole orientation (the geodesic angle)."""

    rms_deg: Triple
    largest_deg: Triple
    geodesic_rms_deg: float
    geodesic_largest_deg: float


@dataclass(frozen=True, slots=True)
class SdCalibration:
    """Shares of the errors, axis by axis, inside one and two reported standard deviations; NaN for n = 0.

    Normal errors with correct standard deviations give 0.683 and 0.954. Infinite and unknown ones are not counted.
    """

    within_1sd: float
    within_2sd: float
    n: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionComparison:
    """A motion against the truth, over the frames whose times match."""

    n_frames: int  # of the motion
    n_truth: int
    n_matched: int
    n_tracked: int  # of the matched frames, like the next two
    n_uncertain: int
    n_lost: int
    largest_time_offset_s: float
    position: PositionErrors
    raw: OrientationErrors
    modulo_run: OrientationErrors  # up to the one symmetry of the body that fits the whole run best
    modulo_frame: OrientationErrors  # up to the nearest symmetry in every frame
    n_symmetries: int  # including the identity
    n_flips: int  # frames whose nearest symmetry is not that of the frame before
    n_singular: int  # true tilts near +-90 degrees, where somersault and twist errors mean little
    position_calibration: SdCalibration
    rotation_calibration: SdCalibration
    better_shift_s: float  # added to the truth's times, this would clearly agree better; whole periods, or 0
    better_rms_3d_mm: float  # the position's error with that shift
    is_transposed: bool  # the truth's rotations are clearly nearer the other way round
    mix_up: str  # a question about the truth's unit, axes or times where these explain why it is far; else ""

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return nan_to_none(asdict(self) | {"questions": list(self.questions)})

    @property
    def questions(self) -> tuple[str, ...]:
        """What is asked about the reference where it is far from the motion, one line each."""
        if self.mix_up:
            return (self.mix_up,)
        asked = []
        for name, share in (("position", self.position_calibration), ("rotation", self.rotation_calibration)):
            if share.n and share.within_2sd < _HARDLY_ANY:
                question = _TRANSPOSED if name == "rotation" and self.is_transposed else _ANOTHER
                asked.append(f"hardly any {name} lies within 2 sd: {question}?")
        if self.better_shift_s:
            then = f"the RMS in space would be {self.better_rms_3d_mm:.2f} mm"
            asked.append(question_shift(self.better_shift_s, "reference", then))
        return tuple(asked)

    def describe(self) -> str:
        """Return the numbers as a short plain table."""
        lines = [
            f"{self.n_matched} of {self.n_truth} reference times matched, at most "
            f"{1e3 * self.largest_time_offset_s:.1f} ms off: "
            f"{self.n_tracked} tracked, {self.n_uncertain} uncertain, {self.n_lost} lost",
        ]
        position = self.position
        rms, largest = (*position.rms_mm, position.rms_3d_mm), (*position.largest_mm, position.largest_3d_mm)
        rows: list[tuple[str, ...]] = [
            ("position [mm]", "RMS", "max"),
            *_rows(("x", "y", "z", "in space"), rms, largest),
        ]
        kinds = {"": self.raw}
        if self.n_symmetries > 1:
            kinds |= {" modulo symmetry, whole run": self.modulo_run, " modulo symmetry, by frame": self.modulo_frame}
        is_turned = self.raw.geodesic_rms_deg > _OTHER_WAY * self.modulo_run.geodesic_rms_deg
        if all(errors == self.raw for errors in kinds.values()):
            kinds = {", raw and modulo symmetry" if len(kinds) > 1 else "": self.raw}
        for title, errors in kinds.items():
            rows.append((f"orientation [deg]{title}",))
            rms = (*errors.rms_deg, errors.geodesic_rms_deg)
            largest = (*errors.largest_deg, errors.geodesic_largest_deg)
            rows += _rows(("somersault", "tilt", "twist", "whole"), rms, largest)
        lines += align_columns(rows, (18, 9, 9))
        if is_turned:
            lines.append("the reference has the body turned to another pose that looks the same: see modulo symmetry")
        if self.n_singular:
            lines.append(f"{self.n_singular} frames near 90 degrees of tilt: their somersault and twist mean little")
        if self.n_flips:
            lines.append(f"{count(self.n_flips, 'jump')} between poses that look the same")
        for name, share in (("position", self.position_calibration), ("rotation", self.rotation_calibration)):
            if share.n:
                lines.append(
                    f"{name} errors within 1 sd {share.within_1sd:.0%} (normal: 68%), "
                    f"within 2 sd {share.within_2sd:.0%} (95%), n = {share.n}"
                )
        return "\n".join([*lines, *self.questions])


def _rows(names: Sequence[str], rms: Sequence[float], largest: Sequence[float]) -> list[tuple[str, str, str]]:
    return [(f"  {name}", f"{a:.2f}", f"{b:.2f}") for name, a, b in zip(names, rms, largest, strict=True)]


def compare_motion(motion: Motion, truth: Truth, symmetries: Sequence[Array]) -> MotionComparison:
    """Compare a motion with the truth, or another reference, frame by frame.

    Each frame goes with the nearest time of the truth, less than a tenth of the shorter period of the two away.
    `symmetries` are the body's (see `airborne.body.symmetry`), including the identity: a body at `R` looks like one at
    `R @ S`. Raises ResultError if no frame with a pose has a matching true time.
    """
    frames, rows, offset = match_times(motion.time_s, truth.time_s)
    status = motion.status[frames]
    has_pose = motion.has_pose[frames]
    frames, rows, posed_offset = frames[has_pose], rows[has_pose], offset[has_pose]
    if not len(frames):
        raise ResultError(
            f"no pose to compare: motion {span(motion.time_s)} with {int(motion.has_pose.sum())} poses, "
            f"truth {span(truth.time_s)}; give the truth of this recording"
        )
    R, true_R = motion.R[frames], truth.R[rows]
    equivalent_R = R[:, None] @ np.stack(list(symmetries))  # (n, symmetries, 3, 3)
    angle = geodesic(equivalent_R, true_R[:, None])
    transposed_angle = geodesic(equivalent_R, np.swapaxes(true_R, -1, -2)[:, None]).min(axis=1)
    nearest = np.argmin(angle, axis=1)
    nearest_R = equivalent_R[np.arange(len(R)), nearest]
    best = int(np.argmin(np.mean(angle**2, axis=0)))
    position_error = motion.position[frames] - truth.position[rows]
    rotation_error = Rotation.from_matrix(nearest_R @ np.swapaxes(true_R, -1, -2)).as_rotvec()
    position_errors = _position_errors(position_error)

    def rms_at(shift_s: float) -> tuple[float, int]:
        frames, rows, _ = match_times(motion.time_s, truth.time_s + shift_s)
        error = (motion.position[frames] - truth.position[rows])[motion.has_pose[frames]]
        return float(1e3 * _rms(np.linalg.norm(error, axis=-1))) if len(error) else math.nan, len(error)

    shift_s, shifted_mm = best_time_shift(truth.time_s, position_errors.rms_3d_mm, rms_at, CLEARLY_BETTER)
    return MotionComparison(
        n_frames=len(motion),
        n_truth=len(truth.time_s),
        n_matched=len(status),
        n_tracked=int(np.sum(status == Status.TRACKED.value)),
        n_uncertain=int(np.sum(status == Status.UNCERTAIN.value)),
        n_lost=int(np.sum(status == Status.LOST.value)),
        largest_time_offset_s=float(posed_offset.max()),
        position=position_errors,
        raw=_orientation_errors(R, true_R),
        modulo_run=_orientation_errors(equivalent_R[:, best], true_R),
        modulo_frame=_orientation_errors(nearest_R, true_R),
        n_symmetries=len(symmetries),
        n_flips=int(np.sum(np.diff(nearest) != 0)),
        n_singular=int(np.sum(is_near_singular(angles_from_matrix(true_R)))),
        position_calibration=sd_calibration(position_error, motion.position_sd[frames]),
        rotation_calibration=sd_calibration(rotation_error, motion.rotation_sd[frames]),
        better_shift_s=shift_s,
        better_rms_3d_mm=shifted_mm,
        is_transposed=bool(_rms(transposed_angle) < _TRANSPOSED_NEARER * _rms(angle.min(axis=1))),
        mix_up=question_mix_up(
            Paths(motion.time_s, np.where(motion.has_pose[:, None], motion.position, np.nan)[:, None]),
            Paths(truth.time_s, truth.position[:, None]),
        ),
    )


def _position_errors(error: Array) -> PositionErrors:
    distance = np.linalg.norm(error, axis=-1)
    return PositionErrors(
        _triple(1e3 * _rms(error)),
        _triple(1e3 * np.abs(error).max(axis=0)),
        float(1e3 * _rms(distance)),
        float(1e3 * distance.max()),
    )


def _orientation_errors(R: Array, true_R: Array) -> OrientationErrors:
    error = np.rad2deg(wrap(angles_from_matrix(R) - angles_from_matrix(true_R)))
    angle = np.rad2deg(geodesic(R, true_R))
    return OrientationErrors(
        _triple(_rms(error)), _triple(np.abs(error).max(axis=0)), float(_rms(angle)), float(angle.max())
    )


def sd_calibration(error: Array, sd: Array) -> SdCalibration:
    """Count the errors within one and two of their reported standard deviations, arrays of one shape."""
    is_known = np.isfinite(sd)
    error, sd = np.abs(error[is_known]), sd[is_known]
    if not len(error):
        return SdCalibration(math.nan, math.nan, 0)
    return SdCalibration(float(np.mean(error <= sd)), float(np.mean(error <= 2 * sd)), len(error))


def _rms(values: Array) -> Array:
    return np.sqrt(np.mean(values**2, axis=0))


def _triple(values: Array) -> Triple:
    x, y, z = values.tolist()
    return x, y, z


def or_dash(number: float, form: str) -> str:
    """Format a number with a specification such as ".1f"; NaN as a dash."""
    return "-" if math.isnan(number) else format(number, form)


def nan_to_none(value: Any) -> Any:
    """Turn NaN into None, recursively."""
    if isinstance(value, dict):
        return {key: nan_to_none(item) for key, item in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value
