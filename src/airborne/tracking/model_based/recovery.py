"""Recovery: where the body was missed, a global search around the predictions, and fits from what it found."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.appearance.model import Appearance
from airborne.body import Pose
from airborne.tracking.model_based.fitter import Fitter, JudgedFit
from airborne.tracking.model_based.gauss_newton import NEAR
from airborne.tracking.model_based.global_search import SearchRange, search_globally
from airborne.tracking.model_based.later_frames import is_same, regions_near
from airborne.video import Frames

# divides the proposals of a search about a fit that may be right: on seven synthetic throws as many of 840 starts up to
# 0.3 m and 30 degrees off led back, and errors stayed
_THRIFT = 4
_N_FITTED = 3  # of the poses found
_N_CONFIRM = 2  # of the best poses found that lead back to a fit confirm it


def recover(
    fitter: Fitter,
    predicted: Sequence[Pose],
    frames: Frames,
    appearance: Appearance,
    *,
    gap_s: float,
    suspect: Pose | None = None,
) -> JudgedFit | None:
    """Fit from the poses that a search finds, without a prior; None where no view shows any of them.

    gap_s: the time since the body was last found. suspect: a pose fitted here before that may be right; None is
    returned, too, where the best poses found lead back to it.
    """
    search_range = SearchRange.after(gap_s)
    candidates = search_globally(
        fitter.render_model,
        predicted,
        frames,
        appearance,
        search_range=search_range,
        thrift=1 if suspect is None else _THRIFT,
    )
    learned = regions_near(fitter, candidates, frames, appearance)
    if not learned.masks.regions:
        return None

    def evidence(pose: Pose) -> float:
        return fitter.agreement(pose, learned).evidence

    poses = [fitter.fit_silhouettes(pose, learned, NEAR, None) for pose in candidates[:_N_CONFIRM]]
    if suspect is not None and all(is_same(pose, suspect) for pose in poses):
        return None
    poses += [fitter.fit_silhouettes(pose, learned, NEAR, None) for pose in candidates[_N_CONFIRM:]]
    best = sorted(poses, key=evidence, reverse=True)[:_N_FITTED]
    fit = max((fitter.fit_images([pose], learned, None) for pose in best), key=lambda fit: evidence(fit.pose))
    return fitter.judge(fit, candidates, learned, None)
