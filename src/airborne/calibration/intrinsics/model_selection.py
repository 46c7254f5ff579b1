"""Model selection for cameras from control points, by leave-one-out cross-validation. Arrays only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airborne.calibration.intrinsics.physical import Pinhole, PinholeModel, fit_pinhole
from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """One camera fitted to all its points, and once more without each of them."""

    model: PinholeModel
    pinhole: Pinhole
    refits: tuple[Pinhole, ...]  # (n,), fitted without point i
    world: Array  # (n, 3) [m]
    px: Array  # (n, 2) [px]

    @property
    def residual_px(self) -> Array:
        """Measured minus projected pixels (n, 2) [px]."""
        return self.px - self.pinhole.px_from_world(self.world)

    @property
    def shift_sd_px(self) -> float:
        """Standard deviation of a projected point's coordinate due to the fit, RMS over the points [px]."""
        n, p = 2 * len(self.world), self.model.n_parameters
        return float(np.sqrt(np.sum(self.residual_px**2) / max(n - p, 1) * p / n))

    @property
    def held_out_px(self) -> Array:
        """The same for the camera fitted without the point (n, 2) [px]."""
        return self.px - np.array([p.px_from_world(x) for p, x in zip(self.refits, self.world, strict=True)])


def leave_one_out(pinhole: Pinhole, model: PinholeModel, world: Array, px: Array) -> Solution:
    """Refit a pinhole by least squares without each point, starting from the fit to all."""
    keep = ~np.eye(len(world), dtype=bool)
    refits = tuple(fit_pinhole(pinhole, model, world[k], px[k]) for k in keep)
    return Solution(model, pinhole, refits, world, px)


def models_for(models: Sequence[PinholeModel], n_points: int) -> list[PinholeModel]:
    """Return the models with fewer free parameters than the coordinates that remain without one point."""
    return [model for model in models if model.n_parameters < 2 * (n_points - 1)]


def choose_simplest(solutions: Sequence[Solution]) -> Solution:
    """Return the first (simplest) solution that is not clearly worse than the best on held-out points.

    Clearly: the mean difference of squared held-out errors, point by point, exceeds its standard error.
    """
    squares = [np.sum(solution.held_out_px**2, axis=1) for solution in solutions]
    best = min(squares, key=np.mean)
    for solution, square in zip(solutions, squares, strict=True):
        excess = square - best
        if np.mean(excess) <= np.std(excess, ddof=1) / np.sqrt(len(excess)):
            return solution
    raise AssertionError("the best solution is never worse than itself")
