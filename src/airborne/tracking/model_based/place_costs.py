"""Which of several fits that have limbs in different places is the likeliest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.tracking.model_based.degrees_of_freedom import PosePrior
from airborne.tracking.model_based.gauss_newton import Fit
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.status import mask_agreement
from airborne.tracking.model_based.turned_pelvis import is_improbable

# what a limb costs that is not where it was expected; of synthetic limbs moved at 7, a third more were wrong
_LOST_NATS = 10.0


def best_place(
    render_model: RenderModel,
    fits: Sequence[Fit],
    learned: LearnedRegions,
    *,
    prior: PosePrior | None,
    widened: PosePrior | None,
    n_lost: int = 1,
) -> tuple[Fit, PosePrior | None]:
    """Return the first fit, or a better one with n limbs away from where they were expected, each with its prior."""
    misfit, lost = min(each.equations.misfit for each in fits), n_lost * _LOST_NATS

    def cost(fit: Fit, prior: PosePrior | None) -> float:
        return _place_cost(render_model, fit, learned, misfit, prior=prior)

    costs = [cost(each, widened) + lost for each in fits]
    stays = min(cost(fits[0], prior), costs[0])
    best = int(np.argmin(costs))
    return (fits[best], widened) if costs[best] < stays else (fits[0], prior)


def improbable_nats(model: BodyModel, pose: Pose) -> float:
    """Return what a pose costs that people hardly ever are in [nat]: as much as a lost limb."""
    return _LOST_NATS * is_improbable(model, pose)


def _place_cost(
    render_model: RenderModel, fit: Fit, learned: LearnedRegions, misfit: float, *, prior: PosePrior | None
) -> float:
    """Return minus the log-probability of a fit among others that have a limb elsewhere [nat].

    The images alone do not tell an uncovered limb from one of a slightly different shade: both residuals are beyond
    what counts. So the mask's evidence counts too, a patch of pixels as one. A trunk that is twisted to its limits, or
    crossed legs, are as unlikely as a lost limb.
    """
    posed = render_model.with_pose(fit.equations.pose)
    of_mask = mask_agreement(render_model, posed, *learned.views).evidence / fit.equations.shared
    return fit.objective(misfit, prior) - of_mask + improbable_nats(render_model.model, fit.pose)
