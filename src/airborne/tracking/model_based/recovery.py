"""Recovery: where the body was missed, a global search around the predictions, and fits from what it found."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.appearance.model import Appearance
from airborne.body import Pose
from airborne.tracking.model_based.fitter import Fitter, JudgedFit
from airborne.tracking.model_based.gauss_newton import NEAR
from airborne.tracking.model_based.global_search import SearchRange, search_globally
from airborne.tracking.model_based.later_frames import regions_near
from airborne.video import Frames

_N_FITTED = 3  # of the poses found


def recover(
    fitter: Fitter, predicted: Sequence[Pose], frames: Frames, appearance: Appearance, *, gap_s: float
) -> JudgedFit | None:
    """Fit from the poses that a search finds, without a prior; None where no view shows any of them.

    gap_s: the time since the body was last found.
    """
    search_range = SearchRange.after(gap_s)
    candidates = search_globally(fitter.render_model, predicted, frames, appearance, search_range=search_range)
    learned = regions_near(fitter, candidates, frames, appearance)
    if not learned.regions:
        return None

    def evidence(pose: Pose) -> float:
        return fitter.agreement(pose, learned).evidence

    poses = [fitter.fit_silhouettes(pose, learned, NEAR, None) for pose in candidates]
    best = sorted(poses, key=evidence, reverse=True)[:_N_FITTED]
    fit = max((fitter.fit_images([pose], learned, None) for pose in best), key=lambda fit: evidence(fit.pose))
    return fitter.judge(fit, candidates, learned, None)
