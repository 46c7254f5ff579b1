"""Robust bundle adjustment by Levenberg-Marquardt, and the covariance of its result.

Reduced camera system as in Triggs et al. 2000 (Bundle adjustment - a modern synthesis); iteratively reweighted; each
source's noise scaled to its own residuals (variance component estimation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.calibration.bundle.loss import Loss
from airborne.calibration.bundle.problem import build_problem, initial_state, rig_from_state, sources_from_state
from airborne.calibration.bundle.robust_fit import LEAST_DECREASE, RobustFit
from airborne.calibration.bundle.source import CameraPrior, FreeParameters, Source
from airborne.calibration.bundle.uncertainty import estimate_uncertainty
from airborne.cameras.camera import Camera, Rig, scale_lengths
from airborne.errors import CalibrationError
from airborne.geometry.descent import Outcome
from airborne.types import Array, Ints


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjustment:
    """Cameras, points and targets that fit all sources best, and their uncertainty."""

    rig: Rig
    sources: tuple[Source, ...]  # as passed in, with the estimated points and targets
    free: Mapping[str, FreeParameters]
    prior: CameraPrior | None
    residual_px: tuple[Array, ...]  # by source (n, 2), measured minus projected [px]; NaN: the point was left out
    weight: tuple[Array, ...]  # by source (n,), 1 for what fits, near 0 for what does not
    noise_px: tuple[float, ...]  # by source: the estimated standard deviation of a coordinate with sd_px 1 [px]
    camera_sd: Array  # (cameras, 18), in the units of `lenses.CAMERA_PARAMETERS`; 0 where fixed
    covariance: Array  # of the cameras' free parameters
    lag_s: tuple[Array, ...]  # by source: each observation's lag (n,) [s]
    columns: Ints  # (cameras, 18): each parameter's row in the covariance; -1 where fixed
    is_gauge_free: bool  # nothing fixes the world: standard deviations are relative to the rig
    has_converged: bool  # False: stopped at the limit of steps

    @property
    def target_row(self) -> int:
        """The row of the source that is a moving target seen by all cameras, as a board is; there must be one."""
        return next(i for i, s in enumerate(self.sources) if s.world_from_target is not None and not s.is_of_lens)

    def rms_px(self, *, source: int | None = None, camera: int | None = None) -> float:
        """Return the RMS distance of a source's, a camera's or all observations [px], unweighted."""
        rows = [
            np.sum(r**2, axis=1)[(camera is None) | (s.camera == camera)]
            for i, (r, s) in enumerate(zip(self.residual_px, self.sources, strict=True))
            if source in (None, i)
        ]
        squares = np.concatenate([np.zeros(0), *rows])
        return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else float("nan")

    def with_estimated_noise(self) -> tuple[Source, ...]:
        """Return the sources with their estimated noise as known, so that subsets are weighted alike."""
        return tuple(
            replace(source, sd_px=np.asarray(source.sd_px) * noise, sd_is_known=True)
            for source, noise in zip(self.sources, self.noise_px, strict=True)
        )

    def transform(self, new_from_old: RigidTransform, scale: float = 1.0) -> tuple[Rig, tuple[Source, ...]]:
        """Return the rig and the sources in another world frame: scaled, then moved rigidly."""
        rig = Rig(tuple(_transform_camera(camera, new_from_old, scale) for camera in self.rig))
        return rig, tuple(_transform_source(source, new_from_old, scale) for source in self.sources)


def adjust(
    rig: Rig,
    sources: Sequence[Source],
    free: Mapping[str, FreeParameters] | FreeParameters | None = None,
    *,
    prior: CameraPrior | None = None,
    loss: Loss = "cauchy",
    progress: Callable[[int, float], None] | None = None,
    least_decrease: float = LEAST_DECREASE,
) -> Adjustment:
    """Estimate cameras, free points and targets from all sources at once, starting from `rig` and the sources' values.

    free: the free parameters of all cameras, or by name (default `FreeParameters()`). prior: about the initial cameras.
    progress is called with the step's number and the cost. It stops where a step would lower the cost by less than
    `least_decrease` [nat]. Raises CalibrationError where nothing is measured.
    """
    free_by_camera = _free_by_camera(rig, free if free is not None else FreeParameters())
    problem = build_problem(rig, sources, free_by_camera)
    state = initial_state(rig, sources, problem)
    if not problem.is_used.any():
        raise CalibrationError("nothing to adjust: no point is seen by enough cameras")
    optimiser = RobustFit(problem, state, prior, loss, progress, least_decrease)
    state, noise, outcome = optimiser.run(_is_noise_known(sources))
    fit = optimiser.linearise(state, noise)
    uncertainty = estimate_uncertainty(
        problem, state, fit.normal, fit.jacobian, weights=fit.row_weights, residuals=fit.rows, loss=loss
    )
    residuals = np.where(problem.is_used[:, None], fit.residual, np.nan)
    rows = [problem.source == i for i in range(len(sources))]
    adjusted = rig_from_state(rig, state)
    covariances = uncertainty.camera_covariances(problem, fit.jacobian, adjusted)
    cameras = tuple(
        replace(camera, shift_sd_px=float(shift_px), covariance=covariance)
        for camera, shift_px, covariance in zip(
            adjusted, uncertainty.shift_sd_px(problem, fit.jacobian), covariances, strict=True
        )
    )
    return Adjustment(
        rig=Rig(cameras),
        sources=sources_from_state(sources, state),
        free=free_by_camera,
        prior=prior,
        residual_px=tuple(residuals[r] for r in rows),
        weight=tuple(fit.weight[r] for r in rows),
        noise_px=tuple(float(scale) for scale in noise.scale),
        camera_sd=np.where(problem.camera_columns >= 0, np.append(uncertainty.sd, 0.0)[problem.camera_columns], 0.0),
        covariance=uncertainty.covariance,
        lag_s=tuple(np.append(state.lags, 0.0)[problem.lag[r]] for r in rows),
        columns=problem.camera_columns,
        is_gauge_free=uncertainty.is_gauge_free,
        has_converged=outcome is not Outcome.OUT_OF_STEPS,
    )


def _free_by_camera(rig: Rig, free: Mapping[str, FreeParameters] | FreeParameters) -> dict[str, FreeParameters]:
    if isinstance(free, FreeParameters):
        return dict.fromkeys(rig.names, free)
    missing = [name for name in rig.names if name not in free]
    if missing:
        raise CalibrationError(
            f"no free parameters are given for camera '{missing[0]}'; given: {', '.join(free) or 'none'}"
        )
    return {name: free[name] for name in rig.names}


def _is_noise_known(sources: Sequence[Source]) -> NDArray[np.bool_]:
    return np.array([source.sd_is_known for source in sources], bool)


def _transform_camera(camera: Camera, new_from_old: RigidTransform, scale: float) -> Camera:
    old = camera.camera_from_world
    scaled = RigidTransform.from_components(old.translation * scale, old.rotation)
    covariance = None if camera.covariance is None else scale_lengths(camera.covariance, scale)
    return replace(camera, camera_from_world=scaled * new_from_old.inv(), covariance=covariance)


def _transform_source(source: Source, new_from_old: RigidTransform, scale: float) -> Source:
    targets = source.world_from_target
    if targets is not None:
        scaled = RigidTransform.from_components(targets.translation * scale, targets.rotation)
        return replace(source, world_from_target=new_from_old * scaled)
    return replace(source, points=new_from_old.apply(source.points * scale))
