"""Every later frame: from the predicted poses to a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.appearance.model import Appearance
from airborne.body import Pose
from airborne.body.chain import delta_between
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import PosePrior
from airborne.tracking.model_based.fitter import Fitter, JudgedFit
from airborne.tracking.model_based.gauss_newton import CLOSE, CLOSE_JOINTED, NEAR
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.left_right_swap import is_nearer
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.status import Reference
from airborne.video import Frames

MARGIN_PX = 32  # of a full frame
_SAME_M, _SAME_RAD = 0.008, 0.035  # silhouettes and images of a right fit agree this closely


def regions_near(fitter: Fitter, poses: Sequence[Pose], frames: Frames, appearance: Appearance) -> LearnedRegions:
    """Crop the images around a body in several poses."""
    bodies = [fitter.render_model.with_pose(pose) for pose in poses]
    return LearnedRegions.of(
        crop_regions(bodies, fitter.render_model.geometry, frames, MARGIN_PX, appearance), appearance
    )


def fit_next(
    fitter: Fitter,
    predicted: Sequence[Pose],
    frames: Frames,
    appearance: Appearance,
    *,
    reference: Reference,
    prior: PosePrior | None,
    searched: Pose | None = None,
) -> JudgedFit | None:
    """Fit from the first predicted pose that agrees with the images, or else from the one of most evidence.

    None where no view shows any of them. `searched`: a pose of these frames in which limbs were searched for already.
    """
    learned = regions_near(fitter, predicted, frames, appearance)
    if not learned.masks.regions:
        return None
    judged = []
    for pose in predicted:
        judged.append((pose, fitter.agreement(pose, learned)))
        if not judged[-1][1].is_suspect(reference):
            break
    expected, agreement = max(judged, key=lambda each: each[1].evidence)
    levels = CLOSE_JOINTED if fitter.moves_joints else CLOSE
    levels = NEAR if agreement.is_suspect(reference) else levels
    starts = [fitter.fit_silhouettes(expected, learned, levels, prior)]
    if not fitter.moves_joints and _is_elsewhere(fitter.render_model, starts[0], expected):
        starts.append(expected)  # silhouettes do not tell colours apart: a round thing turns under them
    fit = fitter.fit_images(starts, learned, prior)
    swaps = [pose for pose in fitter.swap_limbs(fit.pose) if is_nearer(fitter.model, pose, fit.pose, expected)]
    if swaps:
        fit = fitter.fit_images([fit.pose, *swaps], learned, prior)
    return fitter.judge(fit, predicted, learned, prior, searched=searched)


def is_same(pose: Pose, other: Pose) -> bool:
    """Whether two poses are the same as far as silhouettes and images of a right fit agree."""
    delta = delta_between(pose, other)
    rotations = np.linalg.norm(delta[3:].reshape(-1, 3), axis=1)
    return bool(np.linalg.norm(delta[:3]) < _SAME_M and np.all(rotations < _SAME_RAD))


def _is_elsewhere(render_model: RenderModel, pose: Pose, other: Pose) -> bool:
    """Whether a thing has moved between two poses by more than `is_same` allows; both are posed for fits anyhow."""
    (R, t), (R_other, t_other) = ((body.R[0], body.t[0]) for body in map(render_model.with_pose, (pose, other)))
    cosine = (np.sum(R * R_other) - 1) / 2
    return bool(cosine < np.cos(_SAME_RAD) or np.linalg.norm(t - t_other) > _SAME_M)
