"""The robust fit of one bundle adjustment: descents, with the sources' noise scaled to the residuals in between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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
from airborne.calibration.bundle.problem import Problem, State, apply_step, with_target_paths
from airborne.calibration.bundle.source import CameraPrior
from airborne.calibration.bundle.uncertainty import gauge_fixed_inverse, redundancies
from airborne.geometry.descent import Descent, NielsenRule, Outcome, descend
from airborne.types import Array, Ints

_MOST_STEPS, _MOST_SCALINGS = 200, 12  # of the iteration; changes of scale between whole iterations, at most
# predicted decrease of the cost below which the iteration stops: in nat, chosen as 0.004 sds from the end; as a share
# of the cost, chosen between rounding, 1e-16, and what shows
LEAST_DECREASE, _LEAST_SHARE = 1e-5, 1e-10
_SAME_NOISE = 0.01  # relative change of the noise below which it is settled
_DAMPING = NielsenRule(first=1e-3, least=1e-12, most=1e8, least_factor=1 / 10)
_LEAST_SCALE = 1e-6  # of a source's noise, in its assumed standard deviations
_LEAST_REDUNDANCY = 8  # below it, residuals cannot lower the assumed noise


@dataclass(frozen=True, slots=True, eq=False)
class Linearisation:
    """The linearised problem at one state."""

    residual: Array  # (n, 2) [px]
    weight: Array  # (n,)
    row_weights: Array
    rows: Array  # residuals by row
    jacobian: Jacobian
    normal: NormalEquations


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """The noise model of the sources: (sources,)."""

    scale: Array  # of the sources' standard deviations
    effect: Array  # Kish's design effect: correlated observations that are worth an independent one


@dataclass(frozen=True, slots=True, eq=False)
class RobustFit:
    """The minimisation of one problem: descents, each with the noise that the last one left."""

    problem: Problem
    start: State
    prior: CameraPrior | None
    loss: Loss
    progress: Callable[[int, float], None] | None
    least_decrease: float  # [nat]

    def run(self, is_known: NDArray[np.bool_]) -> tuple[State, Noise, Outcome]:
        """Return the best state, the sources' noise, and why the last descent ended."""
        state, n_steps, outcome = self.start, 0, Outcome.OUT_OF_STEPS
        noise = self._estimate_noise(state, Noise(np.ones(len(is_known)), np.ones(len(is_known))), is_known, None)
        for _ in range(_MOST_SCALINGS):
            descent = self._descend(with_target_paths(self.problem, state), noise, n_steps)
            state, fit, outcome = descent.best.state, descent.best.linearisation, descent.outcome
            n_steps += descent.n_steps
            redundancy = redundancies(self.problem, state, fit.normal, fit.jacobian, weights=fit.row_weights)
            new = self._estimate_noise(state, noise, is_known, redundancy)
            change = (
                np.abs(new.scale / noise.scale - 1).max(initial=0),
                np.abs(new.effect / noise.effect - 1).max(initial=0),
            )
            noise = new
            if max(change) < _SAME_NOISE or outcome is Outcome.OUT_OF_STEPS:
                break
        return state, noise, outcome

    def linearise(self, state: State, noise: Noise) -> Linearisation:
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
        normal = normal_equations(problem.layout, jacobian, row_weights, rows)
        return Linearisation(residual, weight, row_weights, rows, jacobian, self._with_prior(normal, state))

    def cost(self, state: State, noise: Noise) -> float:
        """Return minus the log-posterior at a state."""
        _, s = self._squares(state, noise.scale)
        lengths = np.sum((length_residual_m(self.problem, state) / self.problem.length_sd_m) ** 2)
        lags = np.sum((state.lags / self.problem.lag_sd_s) ** 2)
        pixels = np.sum(robust_cost(self.loss, s) / noise.effect[self.problem.source])
        return float(pixels + lengths + lags + self._prior_cost(state)) / 2

    def _descend(self, state: State, noise: Noise, n_before: int) -> Descent[_Iterate]:
        report = self.progress
        return descend(
            _Iterate(self, state, noise),
            lambda state: _Iterate(self, state, noise),
            _DAMPING,
            most_steps=_MOST_STEPS - n_before,
            least_predicted=(self.least_decrease, _LEAST_SHARE),
            progress=report and (lambda n_steps, cost: report(n_before + n_steps, cost)),
        )

    def _squares(self, state: State, scales: Array) -> tuple[Array, Array]:
        """Return the residuals (n, 2) [px] and their squared distances in standard deviations (n,)."""
        problem = self.problem
        residual = residual_px(problem, state)
        s = np.sum(residual**2, axis=1) / (problem.sd_px * scales[problem.source]) ** 2
        return residual, np.where(problem.is_used, np.where(np.isfinite(s), s, BEHIND_CAMERA), 0.0)

    def _estimate_noise(
        self, state: State, noise: Noise, is_known: NDArray[np.bool_], redundancy: Array | None
    ) -> Noise:
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
        return Noise(scale, effect)

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


@dataclass(frozen=True, eq=False)
class _Iterate:
    """A state in a descent, along which the noise stays the same."""

    fit: RobustFit
    state: State
    noise: Noise

    @cached_property
    def linearisation(self) -> Linearisation:
        """The equations here."""
        return self.fit.linearise(self.state, self.noise)

    @cached_property
    def _cost(self) -> float:
        return self.fit.cost(self.state, self.noise)

    def cost(self, reference: _Iterate) -> float:
        """Return minus the log-posterior."""
        return self._cost

    def step(self, damping: float) -> tuple[State, float]:
        """Return the state after a damped step, and the predicted decrease of the cost."""
        problem, normal = self.fit.problem, self.linearisation.normal
        reduced, side, factors, back = normal.reduce(damping)
        step = np.zeros(0)
        if len(reduced):
            step = gauge_fixed_inverse(reduced, gauge_directions(problem, self.state, normal, reduced)) @ side
        other = np.zeros(0)
        if factors is not None:
            other = factors.solve(normal.other_rhs) - back @ step
        predicted = normal.camera_rhs @ step + normal.other_rhs @ other
        squares = step @ normal.cameras @ step + other @ (normal.others @ other)
        predicted -= squares / 2 + step @ normal.coupling @ other
        return apply_step(problem, self.state, step, other), float(predicted)


def _design_effect(scores: Array, cluster: Ints) -> float:
    """Return Kish's design effect: squared sums over clusters over sums of squares; 1 at least."""
    is_clustered = cluster >= 0
    total = float(np.sum(scores[is_clustered] ** 2))
    if total == 0:
        return 1.0
    sums = np.zeros((int(cluster.max()) + 1, 2))
    np.add.at(sums, cluster[is_clustered], scores[is_clustered])
    return max(float(np.sum(sums**2)) / total, 1.0)
