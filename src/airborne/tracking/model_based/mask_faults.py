"""Where a fitted mask and the images do not go together: limbs on what is unlike the body, and what is uncovered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.model_based.degrees_of_freedom import limbs_of
from airborne.tracking.model_based.gauss_newton import Fit
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.misplaced_limbs import LimbFaults, find_misplaced_limbs
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.uncovered import find_uncovered

_BESIDE_M2 = 6e-4  # uncovered beside a limb; on synthetic people such limbs hold half of the joints over 0.1 m off
_FEWEST_VIEWS = 2  # in which something uncovered asks for a limb; chosen: one view shows what stands far behind, too


@dataclass(frozen=True, slots=True, eq=False)
class MaskFaults:
    """A fit, and where its mask and the images do not go together."""

    fit: Fit
    limbs: LimbFaults  # that cover pixels unlike the body
    beside: Sequence[NDArray[np.int64]]  # limbs beside which more than a rim stands uncovered, in two views
    asks_for_limb: bool  # whether something like a limb stands out that the body does not cover


def find_mask_faults(render_model: RenderModel, fit: Fit, learned: LearnedRegions) -> MaskFaults:
    """Find where the mask of a fit and the images do not go together."""
    limbs = find_misplaced_limbs(render_model, fit.pose, *learned.views)
    pixels, beside_m2 = find_uncovered(render_model, render_model.with_pose(fit.pose), *learned.views)
    of_limb = ((limb, beside_m2[:, limb].sum(axis=1)) for limb in limbs_of(render_model.model))
    beside = [limb for limb, areas_m2 in of_limb if np.sum(areas_m2 > _BESIDE_M2) >= _FEWEST_VIEWS]
    return MaskFaults(fit, limbs, beside, sum(bool(each.any()) for each in pixels) >= _FEWEST_VIEWS)
