"""Calibration from control points, with its errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.diagnosis import Finding, check_points, check_solutions, decompose_cameras
from airborne.calibration.intrinsics.common_lens import common_lens_sd
from airborne.calibration.intrinsics.model_selection import (
    Solution,
    candidates_for,
    choose_simplest,
    leave_one_out,
    place_sd,
)
from airborne.calibration.intrinsics.physical import (
    SEVEN_PARAMETERS,
    Pinhole,
    anneal_pinhole,
    parameter_covariance,
    parameter_names,
)
from airborne.calibration.sources.control_points import SURVEYED_SD, ControlPoints
from airborne.cameras.camera import Rig
from airborne.cameras.dlt import Decomposition, dlt_coefficients, fit_dlt
from airborne.errors import CalibrationError
from airborne.geometry.triangulation import px_from_points, triangulate
from airborne.types import Array

CalibrationMethod = Literal["lm", "annealing"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraFit:
    """How well one camera fits its control points. RMS values are of distances, over the points it sees."""

    name: str
    model: str  # the selected one
    n_points: int
    residual_px: Array  # (n, 2) [px], measured minus projected; NaN where not seen
    held_out_px: Array  # (n, 2) [px], the same for the camera fitted without the point
    m_per_px: Array  # (n,) [m/px], at the point's depth
    held_out_rms_px: dict[str, float]  # [px] for every model tried
    sd: dict[str, float]  # standard deviations of the fitted numbers, units in the names
    covariance: Array  # (7, 7) of turn [rad] and place [m], both in the camera's axes, and focal length [share]
    dlt_rms_px: float  # the 11-parameter DLT's own residual [px]
    dlt: Array  # (11,), L1..L11

    @property
    def rms_px(self) -> float:
        """RMS distance between measured and projected points [px]."""
        return _rms(self.residual_px)

    @property
    def rms_m(self) -> float:
        """The same across the line of sight at the points' depths [m]."""
        return _rms(self.residual_px * self.m_per_px[:, None])

    @property
    def held_out_m(self) -> float:
        """RMS distance of points from the camera fitted without them, at their depths [m]."""
        return _rms(self.held_out_px * self.m_per_px[:, None])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """A rig with its errors on control points."""

    rig: Rig
    method: CalibrationMethod
    fits: tuple[CameraFit, ...]  # in the rig's order
    held_out_points_m: (
        Array  # (n, 3) [m], triangulated minus surveyed, by cameras fitted without the point; NaN: < 2 views
    )
    findings: tuple[Finding, ...]  # what casts doubt on it

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as plain sentences."""
        return tuple(each.sentence for each in self.findings)

    @property
    def held_out_3d_m(self) -> float:
        """RMS distance of triangulated held-out points from the surveyed ones [m]; NaN with one camera."""
        return _rms(self.held_out_points_m)


def calibrate(
    points: ControlPoints, sizes: Mapping[str, tuple[int, int]], *, method: CalibrationMethod = "lm", seed: int = 0
) -> Calibration:
    """Estimate every camera that the control points were clicked in.

    sizes: (width, height) [px] by camera name. Each camera starts from the decomposition of its DLT. Method "lm": least
    squares on the pixels for physical cameras of growing complexity; the simplest that predicts held-out points as well
    as the best is selected. Method "annealing": paper B's seven-parameter camera by simulated annealing, `seed` fixed.
    Raises CalibrationError where a camera cannot be estimated; what is only doubtful goes to `findings`.
    """
    if method not in ("lm", "annealing"):
        raise CalibrationError(f"unknown calibration method '{method}'; expected 'lm' or 'annealing'")
    check_points(points, sizes)
    decompositions = decompose_cameras(points)
    candidates = {
        name: _solve(points, name, size=sizes[name], decomposition=decompositions[name], method=method, seed=seed)
        for name in points.cameras
    }
    solutions = {name: choose_simplest(each) for name, each in candidates.items()}
    common_sd_m = common_lens_sd(candidates, sizes)
    fits = [
        _describe_fit(points, name, solutions[name], candidates[name], common_lens_sd_m=common_sd_m.get(name))
        for name in solutions
    ]
    cameras = [
        replace(
            each.pinhole.camera(fit.name, sizes[fit.name], each.shift_sd_px),
            covariance=fit.covariance,
            world_sd=SURVEYED_SD,
        )
        for fit, each in zip(fits, solutions.values(), strict=True)
    ]
    return Calibration(
        rig=Rig(tuple(cameras)),
        method=method,
        fits=tuple(fits),
        held_out_points_m=_point_errors_left_out(points, solutions),
        findings=check_solutions(points, sizes, decompositions, candidates, solutions=solutions),
    )


def _solve(
    points: ControlPoints,
    name: str,
    *,
    size: tuple[int, int],
    decomposition: Decomposition,
    method: CalibrationMethod,
    seed: int,
) -> list[Solution]:
    is_seen = points.is_seen_by(name)
    world, px = points.world[is_seen], points.px[is_seen, points.cameras.index(name)]
    initial = Pinhole(
        decomposition.R,
        decomposition.centre,
        (decomposition.K[0, 0] + decomposition.K[1, 1]) / 2,
        (np.array(size) - 1) / 2,
    )
    if method == "annealing":
        pinhole = anneal_pinhole(initial, world, px, seed=seed)
        return [leave_one_out(pinhole, SEVEN_PARAMETERS, world, px)]
    return candidates_for(initial, world, px)


def _describe_fit(
    points: ControlPoints, name: str, best: Solution, candidates: list[Solution], *, common_lens_sd_m: Array | None
) -> CameraFit:
    is_seen = points.is_seen_by(name)
    P_dlt = fit_dlt(best.world, best.px)
    covariance = parameter_covariance(best.pinhole, best.model, best.world, best.px)
    sd = np.sqrt(np.diag(covariance))
    places = place_sd(best, candidates, common_lens_sd_m)
    wider = float(np.mean(places / sd[3:6]))  # by the lens model's error: all of them alike
    sd[3:6] = places
    return CameraFit(
        name=name,
        model=best.model.name,
        n_points=int(is_seen.sum()),
        residual_px=_spread_over_points(is_seen, best.residual_px),
        held_out_px=_spread_over_points(is_seen, best.held_out_px),
        m_per_px=_spread_over_points(is_seen, best.pinhole.depth(best.world) / best.pinhole.focal_px),
        held_out_rms_px={solution.model.name: _rms(solution.held_out_px) for solution in candidates},
        sd=dict(zip(parameter_names(best.model), sd.tolist(), strict=True)),
        covariance=_covariance_in_camera(best.pinhole, wider**2 * covariance),
        dlt_rms_px=_rms(best.px - px_from_points(P_dlt[None], best.world)[:, 0]),
        dlt=dlt_coefficients(P_dlt),
    )


def _covariance_in_camera(pinhole: Pinhole, covariance: Array) -> Array:
    """Take the covariance (n, n) of `Pinhole.apply_step` to turn and place in the camera's axes, and focal share."""
    J = np.zeros((7, 7))
    J[:3, :3], J[3:6, 3:6], J[6, 6] = np.eye(3), pinhole.R, 1 / pinhole.focal_px
    return J @ covariance[:7, :7] @ J.T


def _point_errors_left_out(points: ControlPoints, solutions: Mapping[str, Solution]) -> Array:
    """Triangulate each point with cameras fitted without it: (n, 3) [m] minus the surveyed points."""
    n, c = points.px.shape[:2]
    P, px = np.zeros((n, c, 3, 4)), np.full((n, c, 2), np.nan)
    for i, name in enumerate(points.cameras):
        solution = solutions[name]
        for row, pinhole, px_in_camera in zip(
            np.flatnonzero(points.is_seen_by(name)), solution.refits, solution.px, strict=True
        ):
            P[row, i] = pinhole.P
            px[row, i] = pinhole.undistort_px(px_in_camera)
    return triangulate(P, px) - points.world


def _spread_over_points(is_seen: NDArray[np.bool_], values: Array) -> Array:
    """Return values of the seen points as an array over all points, NaN elsewhere."""
    full = np.full((len(is_seen), *values.shape[1:]), np.nan)
    full[is_seen] = values
    return full


def _rms(vectors: Array) -> float:
    """Root mean square length of vectors (n, d), without NaN rows; NaN for none."""
    squares = np.sum(vectors**2, axis=-1)
    squares = squares[~np.isnan(squares)]
    return float(np.sqrt(np.mean(squares))) if len(squares) else float("nan")
