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

from airborne.calibration.bundle.equations import (
    Jacobian,
    NormalEquations,
    gauge_directions,
    jacobian_of,
    length_residual_m,
    normal_equations,
    residual_px,
    rotation_vectors_from,
)
from airborne.calibration.bundle.loss import BEHIND_CAMERA, Loss, robust_cost, robust_scale, robust_weight
from airborne.calibration.bundle.problem import (
    Problem,
    State,
    apply_step,
    build_problem,
    initial_state,
    rig_from_state,
    sources_from_state,
    with_target_paths,
)
from airborne.calibration.bundle.source import CameraPrior, FreeParameters, Source
from airborne.calibration.bundle.uncertainty import estimate_uncertainty, gauge_fixed_inverse, redundancies
from airborne.cameras.camera import Rig
from airborne.errors import CalibrationError
from airborne.types import Array, Ints

_MOST_STEPS, _MOST_SCALINGS = 200, 12  # of the iteration; changes of scale between whole iterations, at most
_CONVERGED = 1e-5  # predicted decrease, relative to the cost and absolute, below which the iteration stops
_SAME_NOISE = 0.01  # relative change of the noise below which it is settled
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-12, 1e8  # of Levenberg and Marquardt, relative to the diagonal
_LEAST_SCALE = 1e-6  # of a source's noise, in its assumed standard deviations
_LEAST_REDUNDANCY = 8  # below it, residuals cannot lower the assumed noise


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
    camera_sd: Array  # (cameras, 15), in the units of `lenses.CAMERA_PARAMETERS`; 0 where fixed
    covariance: Array  # of the cameras' free parameters
    lag_s: tuple[Array, ...]  # by source: each observation's lag (n,) [s]
    columns: Ints  # (cameras, 15): each parameter's row in the covariance; -1 where fixed
    is_gauge_free: bool  # nothing fixes the world: standard deviations are relative to the rig
    has_converged: bool  # False: stopped at the limit of steps

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
) -> Adjustment:
    """Estimate cameras, free points and targets from all sources at once, starting from `rig` and the sources' values.

    free: the free parameters of all cameras, or by name (default `FreeParameters()`). prior: about the initial cameras.
    progress is called with the step's number and the cost. Raises CalibrationError where nothing is measured.
    """
    free_by_camera = _free_by_camera(rig, free if free is not None else FreeParameters())
    problem = build_problem(rig, sources, free_by_camera)
    state = initial_state(rig, sources, problem)
    if not problem.is_used.any():
        raise CalibrationError("nothing to adjust: no point is seen by enough cameras")
    optimiser = _LevenbergMarquardt(problem, state, prior, loss, progress)
    state, noise, has_converged = optimiser.run(_is_noise_known(sources))
    fit = optimiser.linearise(state, noise)
    uncertainty = estimate_uncertainty(
        problem, state, fit.normal, fit.jacobian, weights=fit.row_weights, residuals=fit.rows, loss=loss
    )
    residuals = np.where(problem.is_used[:, None], fit.residual, np.nan)
    rows = [problem.source == i for i in range(len(sources))]
    adjusted = rig_from_state(rig, state)
    cameras = tuple(
        replace(c, shift_sd_px=float(s))
        for c, s in zip(adjusted, uncertainty.shift_sd_px(problem, fit.jacobian), strict=True)
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
        has_converged=has_converged,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Linearisation:
    """The linearised problem at one state."""

    residual: Array  # (n, 2) [px]
    weight: Array  # (n,)
    row_weights: Array
    rows: Array  # residuals by row
    jacobian: Jacobian
    normal: NormalEquations


@dataclass(frozen=True, slots=True, eq=False)
class _Noise:
    """The noise model of the sources: (sources,)."""

    scale: Array  # of the sources' standard deviations
    effect: Array  # Kish's design effect: correlated observations that are worth an independent one


@dataclass(frozen=True, slots=True, eq=False)
class _LevenbergMarquardt:
    """The minimisation of one problem."""

    problem: Problem
    start: State
    prior: CameraPrior | None
    loss: Loss
    progress: Callable[[int, float], None] | None

    def run(self, is_known: NDArray[np.bool_]) -> tuple[State, _Noise, bool]:
        """Return the best state, the sources' noise, and whether the iteration converged."""
        state, n_steps = self.start, 0
        noise = self._noise(state, _Noise(np.ones(len(is_known)), np.ones(len(is_known))), is_known, None)
        for _ in range(_MOST_SCALINGS):
            state, n_steps = self._descend(with_target_paths(self.problem, state), noise, n_steps)
            fit = self.linearise(state, noise)
            redundancy = redundancies(self.problem, state, fit.normal, fit.jacobian, weights=fit.row_weights)
            new = self._noise(state, noise, is_known, redundancy)
            change = (
                np.abs(new.scale / noise.scale - 1).max(initial=0),
                np.abs(new.effect / noise.effect - 1).max(initial=0),
            )
            noise = new
            if max(change) < _SAME_NOISE or n_steps >= _MOST_STEPS:
                return state, noise, n_steps < _MOST_STEPS
        return state, noise, n_steps < _MOST_STEPS

    def linearise(self, state: State, noise: _Noise) -> _Linearisation:
        """Return the weighted equations at a state."""
        problem = self.problem
        residual, s = self._squares(state, noise.scale)
        variance = (problem.sd_px * noise.scale[problem.source]) ** 2 * noise.effect[problem.source]
        weight = np.where(problem.is_used & np.isfinite(residual[:, 0]), robust_weight(self.loss, s), 0.0)
        row_weights = np.concatenate(
            [np.repeat(weight / variance, 2), 1 / problem.length_sd_m**2, 1 / problem.lag_sd_s**2]
        )
        rows = np.concatenate([np.nan_to_num(residual).ravel(), length_residual_m(problem, state), -state.lags])
        jacobian = jacobian_of(problem, state)
        normal = normal_equations(jacobian, row_weights, rows)
        return _Linearisation(residual, weight, row_weights, rows, jacobian, self._with_prior(normal, state))

    def _descend(self, state: State, noise: _Noise, n_steps: int) -> tuple[State, int]:
        damping, growth, cost = _FIRST_DAMPING, 2.0, self._cost(state, noise)
        while n_steps < _MOST_STEPS:
            normal = self.linearise(state, noise).normal
            while damping < _MOST_DAMPING:
                step, other_step, predicted = _step(self.problem, state, normal, damping)
                if predicted <= _CONVERGED * (1 + _CONVERGED * cost):
                    return state, n_steps
                trial = apply_step(self.problem, state, step, other_step)
                new = self._cost(trial, noise)
                n_steps += 1
                if np.isfinite(new) and new < cost:
                    break
                damping, growth = damping * growth, growth * 2
            else:
                return state, n_steps
            gain = (cost - new) / predicted
            state, cost, growth = trial, new, 2.0
            damping = max(damping * max(1 / 10, 1 - (2 * min(gain, 1.0) - 1) ** 3), _LEAST_DAMPING)
            if self.progress is not None:
                self.progress(n_steps, cost)
        return state, n_steps

    def _squares(self, state: State, scales: Array) -> tuple[Array, Array]:
        """Return the residuals (n, 2) [px] and their squared distances in standard deviations (n,)."""
        problem = self.problem
        residual = residual_px(problem, state)
        s = np.sum(residual**2, axis=1) / (problem.sd_px * scales[problem.source]) ** 2
        return residual, np.where(problem.is_used, np.where(np.isfinite(s), s, BEHIND_CAMERA), 0.0)

    def _cost(self, state: State, noise: _Noise) -> float:
        _, s = self._squares(state, noise.scale)
        lengths = np.sum((length_residual_m(self.problem, state) / self.problem.length_sd_m) ** 2)
        lags = np.sum((state.lags / self.problem.lag_sd_s) ** 2)
        pixels = np.sum(robust_cost(self.loss, s) / noise.effect[self.problem.source])
        return float(pixels + lengths + lags + self._prior_cost(state)) / 2

    def _noise(self, state: State, noise: _Noise, is_known: NDArray[np.bool_], redundancy: Array | None) -> _Noise:
        """Estimate the sources' noise from the residuals where it is not known."""
        residual, s = self._squares(state, np.ones(len(is_known)))
        scale, effect = noise.scale.copy(), noise.effect.copy()
        for i in range(len(is_known)):
            rows = (self.problem.source == i) & self.problem.is_used
            if rows.any() and not is_known[i]:
                redundant_share = 1.0 if redundancy is None else redundancy[i] / (2 * rows.sum())  # by what was fitted
                least = 1.0 if redundancy is not None and redundancy[i] < _LEAST_REDUNDANCY else _LEAST_SCALE
                scale[i] = max(robust_scale(self.loss, s[rows] / redundant_share), least)
            if rows.any() and redundancy is not None:
                weight = robust_weight(self.loss, s[rows] / scale[i] ** 2) / self.problem.sd_px[rows] ** 2
                effect[i] = _design_effect(weight[:, None] * np.nan_to_num(residual[rows]), self.problem.cluster[rows])
        return _Noise(scale, effect)

    def _prior_residual(self, state: State) -> Array:
        rotation = rotation_vectors_from(self.start.R, state.R)
        change = [rotation, state.centre - self.start.centre, state.intrinsics - self.start.intrinsics]
        return np.concatenate(change, axis=1)

    def _prior_cost(self, state: State) -> float:
        if self.prior is None:
            return 0.0
        is_free = self.problem.camera_columns >= 0
        return float(np.sum((self._prior_residual(state) / self.prior.sd)[is_free] ** 2))

    def _with_prior(self, normal: NormalEquations, state: State) -> NormalEquations:
        if self.prior is None:
            return normal
        columns, weight = self.problem.camera_columns, 1 / self.prior.sd**2
        is_free = columns >= 0
        cameras, side = normal.cameras.copy(), normal.camera_rhs.copy()
        np.add.at(cameras, (columns[is_free], columns[is_free]), weight[is_free])
        np.add.at(side, columns[is_free], -(weight * self._prior_residual(state))[is_free])
        return replace(normal, cameras=cameras, camera_rhs=side)


def _step(problem: Problem, state: State, normal: NormalEquations, damping: float) -> tuple[Array, Array, float]:
    """Return the step of the cameras, of the others, and the predicted decrease of the cost."""
    reduced, side, factors, back = normal.reduce(damping)
    step = np.zeros(0)
    if len(reduced):
        step = gauge_fixed_inverse(reduced, gauge_directions(problem, state, normal, reduced)) @ side
    other = np.zeros(0)
    if factors is not None:
        other = factors.solve(normal.other_rhs) - back @ step
    predicted = normal.camera_rhs @ step + normal.other_rhs @ other
    predicted -= (step @ normal.cameras @ step + other @ (normal.others @ other)) / 2 + step @ normal.coupling @ other
    return step, other, float(predicted)


def _design_effect(scores: Array, cluster: Ints) -> float:
    """Return Kish's design effect: squared sums over clusters over sums of squares; 1 at least."""
    is_clustered = cluster >= 0
    total = float(np.sum(scores[is_clustered] ** 2))
    if total == 0:
        return 1.0
    sums = np.zeros((int(cluster.max()) + 1, 2))
    np.add.at(sums, cluster[is_clustered], scores[is_clustered])
    return max(float(np.sum(sums**2)) / total, 1.0)


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


def _transform_camera(camera, new_from_old: RigidTransform, scale: float):
    old = camera.camera_from_world
    scaled = RigidTransform.from_components(old.translation * scale, old.rotation)
    return replace(camera, camera_from_world=scaled * new_from_old.inv())


def _transform_source(source: Source, new_from_old: RigidTransform, scale: float) -> Source:
    targets = source.world_from_target
    if targets is not None:
        scaled = RigidTransform.from_components(targets.translation * scale, targets.rotation)
        return replace(source, world_from_target=new_from_old * scaled)
    return replace(source, points=new_from_old.apply(source.points * scale))
