"""Descent of a pose on its normal equations, whose sum over all views and segments is mapped to the pose here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airborne.body import Pose, PosedBody
from airborne.geometry.descent import BacktrackingRule, descend
from airborne.tracking.covariance import covariance_of
from airborne.tracking.model_based.degrees_of_freedom import DegreesOfFreedom, PosePrior
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.twist_equations import Sums, add_score_covariance, map_equations, merge_blocks
from airborne.types import Array

_SHORTER = 0.4  # factor on a step that does not lower the objective
_LEAST_SHARE = 0.1  # of a step: three losses; where none of them gains, the refitted light only fluctuates
_SLACK = 1e-3  # of the objective: the refitted light makes it fluctuate
# across a thing's image: about a face. No difference on synthetic throws; of a recorded plate's tilts 91 and 80 % lie
# within two sds, with blocks of 16 px 86 and 74 %
_PATCHES = 4


@dataclass(frozen=True, slots=True)
class PoseEquations:
    """The normal equations at one pose, mapped to the free degrees of freedom."""

    pose: Pose
    A: Array  # (d, d)
    g: Array  # (d,)
    J: Array  # (segments, 6, d)
    blocks: Sequence[Array]  # (rows, columns, segments, 6) gradients, block by block of each image
    shifted: Sequence[Array]  # (n, segments, 6) changes of the gradients by what a whole image has in common
    cost: float  # robust squared residual
    noise: float  # mean square of the weighted residual, times how many pixels share it
    misfit: float  # the same where the shape is wrong, too: a pose is weighed against its prior by this
    shared: float  # pixels that err together where the shape is wrong
    noise_of_views: Sequence[float]  # `noise` of each image; none of masks

    def covariance(self) -> Array:
        """Return the covariance (d, d) of the free degrees of freedom.

        Residuals vary together over a block, on a thing over a patch: about a face.
        """
        n_segments, score_covariance = len(self.J), np.zeros_like(self.A)
        merged = [merge_blocks(each, _PATCHES) for each in self.blocks] if n_segments == 1 else self.blocks
        for each in [each.reshape(-1, n_segments, 6) for each in merged] + list(self.shifted):
            add_score_covariance(np.ascontiguousarray(each), self.J, score_covariance)
        return covariance_of(self.A, noise=self.noise, score_covariance=score_covariance)

    def objective(self, noise: float, prior_cost: float) -> float:
        """Return minus the log-posterior, for a given variance of the noise."""
        return 0.5 * self.cost / noise + prior_cost


def map_to_dofs(
    render_model: RenderModel,
    dofs: DegreesOfFreedom,
    pose: Pose,
    posed: PosedBody,
    *,
    sums: Sums,
    blocks: Sequence[Array],
    shifted: Sequence[Array],
    totals: Array,
    correlated: float,
    shared: float,
    noise_of_views: Sequence[float] = (),
) -> PoseEquations:
    """Map the segments' equations through the chain of joints.

    correlated, shared: how many pixels have their noise in common, and how many what the wrong shape adds.
    """
    J = np.ascontiguousarray(render_model.jacobian(posed, dofs))
    d = J.shape[-1]
    A, g = np.zeros((d, d)), np.zeros(d)
    map_equations(sums.A, sums.g, J, A, g)
    cost, total, weight = totals
    residual = total / weight if weight > 0 else 1.0
    noise, misfit = float(correlated * residual), float(shared * residual)
    return PoseEquations(pose, A, g, J, blocks, shifted, float(cost), noise, misfit, shared, noise_of_views)


@dataclass(frozen=True, eq=False)
class _Iterate:
    """A pose in a descent."""

    equations: PoseEquations
    dofs: DegreesOfFreedom
    prior: PosePrior | None
    overstep: float | Array  # (d,) factor on the step

    @property
    def misfit(self) -> float:
        """Variance of the residual here."""
        return max(self.equations.misfit, 1e-9)

    @cached_property
    def delta(self) -> Array:
        """The whole step, without overstep: (d,)."""
        equations = self.equations
        return self.dofs.solve_step(equations.pose, equations.A / self.misfit, equations.g / self.misfit, self.prior)

    @cached_property
    def next(self) -> Pose:
        """The pose after the whole step: a descent asks for it to go on, and for where it ends."""
        return self.dofs.update(self.equations.pose, self.overstep * self.delta)

    def cost(self, reference: _Iterate) -> float:
        """Return minus the log-posterior, with the misfit of the reference."""
        return self.equations.objective(reference.misfit, self.dofs.prior_cost(self.equations.pose, self.prior))

    def step(self, share: float) -> tuple[Pose, float]:
        """Return the pose after a share of the step, and the decrease that the images predict without overstep."""
        shorter = share * self.overstep * self.delta
        pose = self.next if share == 1 else self.dofs.update(self.equations.pose, shorter)
        return pose, 0.5 * float(self.delta @ self.equations.A @ self.delta) / self.misfit


def descend_pose(
    evaluate: Callable[[Pose, bool], PoseEquations],
    dofs: DegreesOfFreedom,
    pose: Pose,
    prior: PosePrior | None,
    *,
    most_steps: int,
    overstep: float | Array,
    tolerance: float = 0.0,
) -> tuple[Pose, PoseEquations]:
    """Step downhill; return where the last step leads, which is not evaluated any more, and the equations before it.

    evaluate takes a pose, and whether it is the first. overstep (d,): by how much steps are too short. tolerance:
    squared length of the last step, in sds of the pose, for each degree of freedom.
    """
    descent = descend(
        _Iterate(evaluate(pose, True), dofs, prior, overstep),
        lambda pose: _Iterate(evaluate(pose, False), dofs, prior, overstep),
        BacktrackingRule(_SHORTER, _LEAST_SHARE),
        most_steps=most_steps - 1,
        least_predicted=(0.5 * tolerance * len(dofs.columns), 0.0),
        slack=_SLACK,
    )
    best = descent.best
    return best.equations.pose if descent.n_losses else best.next, best.equations
