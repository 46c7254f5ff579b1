"""What the fit of a whole run moved: where two estimates of a body differ, one is off by as much, or both are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airborne.body import BodyModel
from airborne.body.chain import delta_between
from airborne.motion.joints import UNCERTAIN_SD_M, landmarks
from airborne.motion.motion import Motion
from airborne.tracking.model_based.degrees_of_freedom import joints_of, limbs_of
from airborne.tracking.model_based.misplaced_limbs import DISTINCT_M
from airborne.tracking.model_based.support import mark_unobserved

_CONTRADICTED_SDS = 3.0 * np.sqrt(3.0)  # three along one axis, as sds are root mean squares over three


def forget_moved_limbs(model: BodyModel, tracked: Motion, fitted: Motion) -> Motion:
    """Return the fitted motion, without knowledge of limbs that are not where they were tracked.

    A fit that moves some landmark of a limb by more than `DISTINCT_M` and by more than three sds contradicts the
    tracker: one of them is wrong.
    """
    before, sd_m = landmarks(tracked, model)
    moved_m = np.linalg.norm(landmarks(fitted, model)[0] - before, axis=-1)
    contradicts = moved_m > np.maximum(DISTINCT_M, _CONTRADICTED_SDS * sd_m)
    owners = model.landmark_segments
    covariance = fitted.covariance.copy()
    for limb in limbs_of(model):
        columns = joints_of(model, limb).columns
        for row in np.flatnonzero(contradicts[:, np.isin(owners, limb)].any(axis=1)):
            covariance[row] = mark_unobserved(covariance[row], columns)
    return replace(fitted, covariance=covariance)


def count_moves_as_errors(model: BodyModel, tracked: Motion, fitted: Motion) -> Motion:
    """Return the fitted motion, less certain in frames whose own images do not show some landmark where the fit has it.

    A landmark is moved by more than its sd, and by more than three of those that it was tracked with, or these are
    large. There the whole way from the tracked pose counts as an error of one sd. What a frame shows badly the fit
    takes from the frames beside, and is as sure of it as if these had no error in common: of synthetic people in two
    views, of whom the stature alone was known, 4 % of the joints that it had moved by less than 20 mm were 0.1 m off or
    more, and 34 % of those that it had moved by more than 60 mm.
    """
    (before, tracked_sd_m), (after, sd_m) = landmarks(tracked, model), landmarks(fitted, model)
    moved_m = np.linalg.norm(after - before, axis=-1)
    is_badly_seen = (tracked_sd_m > UNCERTAIN_SD_M) | (moved_m > _CONTRADICTED_SDS * tracked_sd_m)
    covariance = fitted.covariance.copy()
    for row in np.flatnonzero((is_badly_seen & (moved_m > np.sqrt(3) * sd_m)).any(axis=1)):
        moved = delta_between(tracked.pose(row), fitted.pose(row))
        moved[~np.isfinite(np.diagonal(covariance[row]))] = 0
        covariance[row] += np.outer(moved, moved)
    return replace(fitted, covariance=covariance)
