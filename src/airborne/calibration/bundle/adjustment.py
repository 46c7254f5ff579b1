"""Robust bundle adjustment by Levenberg and Marquardt's method, and how well each number is known after it.

Reduced camera equations as in Triggs et al. 2000 (Bundle adjustment - a modern synthesis); weights anew at every step;
each source's noise scaled to its own residuals (variance components).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.calibration.bundle.loss import Loss
from airborne.calibration.bundle.problem import build_problem, initial_state, rig_from_state, sources_from_state
from airborne.calibration.bundle.robust_fit import RobustFit
from airborne.calibration.bundle.source import CameraPrior, FreeParameters, Source
from airborne.calibration.bundle.uncertainty import estimate_uncertainty
from airborne.cameras.camera import Rig
from airborne.errors import CalibrationError
from airborne.geometry.descent import Outcome
from airborne.types import Array, Ints


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjustment:
    """Cameras, points and targets that fit all sources best, and how far to trust them."""

    rig: Rig
    sources: tuple[Source, ...]  # as given, points and targets where they were found
    free: Mapping[str, FreeParameters]
    prior: CameraPrior | None
    residual_px: tuple[Array, ...]  # by source (n, 2), measured minus projected [px]; NaN: the point was left out
    weight: tuple[Array, ...]  # by source (n,), 1 for what fits, near 0 for what does not
    noise_px: tuple[float, ...]  # by source: the standard deviation found of a coordinate with sd_px 1 [px]
    camera_sd: Array  # (cameras, 15), in the units of `lenses.NUMBERS`; 0 where held
    covariance: Array  # of the free numbers of the cameras
    lag_s: tuple[Array, ...]  # by source: each observation's lag (n,) [s]
    columns: Ints  # (cameras, 15): where each number stands in the covariance; -1 where held
    is_gauge_free: bool  # nothing fixes the world: standard deviations are those within the rig
    has_converged: bool  # False: stopped after the most steps

    def rms_px(self, *, source: int | None = None, camera: int | None = None) -> float:
        """Return the RMS distance of a source's, a camera's or all observations [px], each with its robust weight 1."""
        rows = [
            np.sum(r**2, axis=1)[(camera is None) | (s.camera == camera)]
            for i, (r, s) in enumerate(zip(self.residual_px, self.sources, strict=True))
            if source in (None, i)
        ]
        squares = np.concatenate([np.zeros(0), *rows])
        return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else float("nan")

    def with_estimated_noise(self) -> tuple[Source, ...]:
        """Return the sources with the noise that was found as known, so that a part of them is fitted alike."""
        return tuple(
            replace(source, sd_px=np.asarray(source.sd_px) * noise, sd_is_known=True)
            for source, noise in zip(self.sources, self.noise_px, strict=True)
        )

    def transform(self, new_from_old: RigidTransform, scale: float = 1.0) -> tuple[Rig, tuple[Source, ...]]:
        """Return the rig and the sources in another world, first grown by a scale, then moved."""
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
) -> Adjustment:
    """Find cameras, free points and targets from all sources at once, beginning from `rig` and the sources' starts.

    freedom: what may change, for all cameras or by name (default `Freedom()`). prior: what is known of the cameras
    beforehand. progress is told the step's number and the cost. Raises CalibrationError where nothing is measured.
    """
    freedoms = _free_by_camera(rig, free if free is not None else FreeParameters())
    task = build_problem(rig, sources, freedoms)
    state = initial_state(rig, sources, task)
    if not task.is_used.any():
        raise CalibrationError("nothing to adjust: no point is seen by enough cameras")
    search = RobustFit(task, state, prior, loss, progress)
    state, noise, outcome = search.run(_is_noise_known(sources))
    fit = search.linearise(state, noise)
    found = estimate_uncertainty(
        task, state, fit.normal, fit.jacobian, weights=fit.row_weights, residuals=fit.rows, loss=loss
    )
    residuals = np.where(task.is_used[:, None], fit.residual, np.nan)
    rows = [task.source == i for i in range(len(sources))]
    adjusted = rig_from_state(rig, state)
    cameras = tuple(
        replace(c, shift_sd_px=float(s)) for c, s in zip(adjusted, found.shift_sd_px(task, fit.jacobian), strict=True)
    )
    return Adjustment(
        rig=Rig(cameras),
        sources=sources_from_state(sources, state),
        free=freedoms,
        prior=prior,
        residual_px=tuple(residuals[r] for r in rows),
        weight=tuple(fit.weight[r] for r in rows),
        noise_px=tuple(float(scale) for scale in noise.scale),
        camera_sd=np.where(task.camera_columns >= 0, np.append(found.sd, 0.0)[task.camera_columns], 0.0),
        covariance=found.covariance,
        lag_s=tuple(np.append(state.lags, 0.0)[task.lag[r]] for r in rows),
        columns=task.camera_columns,
        is_gauge_free=found.is_gauge_free,
        has_converged=outcome is not Outcome.OUT_OF_STEPS,
    )


def _free_by_camera(rig: Rig, freedom: Mapping[str, FreeParameters] | FreeParameters) -> dict[str, FreeParameters]:
    if isinstance(freedom, FreeParameters):
        return dict.fromkeys(rig.names, freedom)
    missing = [name for name in rig.names if name not in freedom]
    if missing:
        raise CalibrationError(f"no freedom is given for camera '{missing[0]}'; given: {', '.join(freedom) or 'none'}")
    return {name: freedom[name] for name in rig.names}


def _is_noise_known(sources: Sequence[Source]) -> NDArray[np.bool_]:
    return np.array([source.sd_is_known for source in sources], bool)


def _transform_camera(camera, new_from_old: RigidTransform, scale: float):
    place = camera.camera_from_world
    grown = RigidTransform.from_components(place.translation * scale, place.rotation)
    return replace(camera, camera_from_world=grown * new_from_old.inv())


def _transform_source(source: Source, new_from_old: RigidTransform, scale: float) -> Source:
    targets = source.world_from_target
    if targets is not None:
        grown = RigidTransform.from_components(targets.translation * scale, targets.rotation)
        return replace(source, world_from_target=new_from_old * grown)
    return replace(source, points=new_from_old.apply(source.points * scale))
