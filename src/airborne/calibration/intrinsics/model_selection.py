"""Model selection for cameras from control points, by leave-one-out cross-validation. Arrays only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.intrinsics.physical import (
    FISHEYE_MODELS,
    PINHOLE_MODELS,
    WIDE_MODELS,
    Pinhole,
    PinholeModel,
    fit_pinhole,
    parameter_covariance,
)
from airborne.calibration.intrinsics.refits import refit_pinholes
from airborne.types import Array

_MOST_ALONE, _N_FOLDS = 30, 10  # points left out one by one; of more points every tenth at once
_N_PARTS = 25  # of an image, for the jackknife
_COORDINATES_PER_PARAMETER = 3  # of a wide lens, at least: fewer points would bend it to their noise


@dataclass(frozen=True, eq=False)
class Solution:
    """One camera fitted to all its points, and once more without each of them."""

    model: PinholeModel
    pinhole: Pinhole
    refits: tuple[Pinhole, ...]  # (n,), fitted without point i
    world: Array  # (n, 3) [m]
    px: Array  # (n, 2) [px]

    @cached_property
    def residual_px(self) -> Array:
        """Measured minus projected pixels (n, 2) [px]."""
        return self.px - self.pinhole.px_from_world(self.world)

    @property
    def shift_sd_px(self) -> float:
        """Standard deviation of a projected point's coordinate due to the fit, RMS over the points [px]."""
        n, p = 2 * len(self.world), self.model.n_parameters
        return float(np.sqrt(np.sum(self.residual_px**2) / max(n - p, 1) * p / n))

    @cached_property
    def held_out_px(self) -> Array:
        """The same for the camera fitted without the point (n, 2) [px]."""
        return self.px - np.array([p.px_from_world(x) for p, x in zip(self.refits, self.world, strict=True)])


def leave_one_out(pinhole: Pinhole, model: PinholeModel, world: Array, px: Array) -> Solution:
    """Refit a pinhole by least squares without each point, of many points without every tenth, from the fit to all."""
    n = len(world)
    fold = np.arange(n) if n <= _MOST_ALONE else np.arange(n) % _N_FOLDS
    refits = refit_pinholes(pinhole, model, world, px, fold != np.arange(fold.max() + 1)[:, None])
    return Solution(model, pinhole, tuple(refits[k] for k in fold), world, px)


def candidates_for(initial: Pinhole, world: Array, px: Array) -> list[Solution]:
    """Return one camera fitted with every model that its points support, the simplest first.

    A fisheye is offered the models of Kannala and Brandt alone, any other camera all models.
    """
    solutions, start = list[Solution](), initial
    if initial.lens == "brown":
        few = [model for model in PINHOLE_MODELS if model.n_parameters < 2 * (len(world) - 1)]
        solutions = [leave_one_out(fit_pinhole(initial, model, world, px), model, world, px) for model in few]
        start = next((s.pinhole for s in solutions if s.model.terms), initial)
    for model in FISHEYE_MODELS if initial.lens == "fisheye" else WIDE_MODELS:
        is_supported = _COORDINATES_PER_PARAMETER * model.n_parameters <= 2 * len(world)
        if is_supported or not (solutions or model is not FISHEYE_MODELS[0]):
            within = [
                s.pinhole for s in solutions if s.model.lens == model.lens and set(s.model.terms) <= {*model.terms}
            ]
            pinhole = fit_pinhole(within[-1] if within else start, model, world, px)
            solutions.append(leave_one_out(pinhole, model, world, px))
    return sorted(solutions, key=lambda solution: solution.model.n_parameters)


def choose_simplest(solutions: Sequence[Solution]) -> Solution:
    """Return the first (simplest) solution that is not clearly worse than the best on held-out points."""
    return as_good_as_best(solutions)[0]


def as_good_as_best(solutions: Sequence[Solution]) -> list[Solution]:
    """Return the solutions that are not clearly worse than the best on held-out points.

    Clearly: the mean difference of squared held-out errors, point by point, exceeds its standard error.
    """
    squares = [np.sum(solution.held_out_px**2, axis=1) for solution in solutions]
    best = min(squares, key=np.mean)
    excess = [square - best for square in squares]
    return [
        solution
        for solution, own in zip(solutions, excess, strict=True)
        if np.mean(own) <= np.std(own, ddof=1) / np.sqrt(len(own))
    ]


def place_sd(chosen: Solution, candidates: Sequence[Solution], common_lens_sd_m: Array | None = None) -> Array:
    """Return the standard deviation of a camera's position (3,) [m], with the error of its lens model.

    The larger of that of independent errors and that of a jackknife over parts of the image, where a lens that fits
    badly errs alike; the differences to the models that predict held-out points as well; and the shifts (3,) [m] with
    the lens that is common to cameras alike, if there is one.
    """
    sd = np.sqrt(np.diag(parameter_covariance(chosen.pinhole, chosen.model, chosen.world, chosen.px)))[3:6]
    others = [s.pinhole.centre - chosen.pinhole.centre for s in as_good_as_best(candidates)]
    model_sd = np.hypot(
        np.sqrt(np.mean(np.square(others), axis=0)), 0.0 if common_lens_sd_m is None else common_lens_sd_m
    )
    return np.hypot(np.maximum(sd, _jackknife_sd(chosen)), model_sd)


def _jackknife_sd(solution: Solution) -> Array:
    """Return the standard deviation (3,) [m] of the position by leaving out parts of the image, one after another."""
    centres = np.array([p.centre for p in dict.fromkeys(solution.refits)])
    if len(solution.world) > _MOST_ALONE:
        part = _parts_of_image(solution.px)
        kept = part != np.arange(part.max() + 1)[:, None]
        refits = refit_pinholes(solution.pinhole, solution.model, solution.world, solution.px, kept)
        centres = np.array([refit.centre for refit in refits])
    return np.sqrt((len(centres) - 1) * np.var(centres, axis=0))


def _parts_of_image(px: Array) -> NDArray[np.integer]:
    """Return each point's part (n,) of `_N_PARTS` parts with equally many points: columns, each cut into rows."""
    n_side = round(_N_PARTS**0.5)
    column = np.argsort(np.argsort(px[:, 0])) * n_side // len(px)
    part = np.zeros(len(px), int)
    for k in range(n_side):
        own = column == k
        part[own] = k * n_side + np.argsort(np.argsort(px[own, 1])) * n_side // own.sum()
    return part
