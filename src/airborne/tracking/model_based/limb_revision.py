"""A limb that was found again, followed back in time from there to where it had been lost.

At each earlier time there are then two places of the limb: where it was found at first, and where it is followed to
from later. Up to some frame the first is right, and from there on the second. That frame is where the sum of what the
images, the masks and the prediction say is best: the best path through two hypotheses. A path that jumps costs as much
as a limb that is lost; one on which the two places meet jumps nowhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance
from airborne.body import Pose
from airborne.tracking import predictors
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, joints_of
from airborne.tracking.model_based.fitter import LOST_NATS, Fitter
from airborne.tracking.model_based.gauss_newton import NEAR, Fit, fit_silhouettes
from airborne.tracking.model_based.later_frames import regions_near
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.misplaced_limbs import limb_distance, with_limb
from airborne.video import Frames

_MEET_M = 0.05  # two places of a limb nearer than this are one, as in `tracking.passes`
_HOPELESS_NATS = 30.0  # a path that is worse than the best one by so much is not followed further

PriorOf = Callable[[Pose, float], PosePrior | None]  # from an expected pose, and the time since the one before [s]


@dataclass(frozen=True, slots=True, eq=False)
class BackwardFit:
    """One earlier time with the limb as it is followed to from later."""

    index: int  # of the frames
    fit: Fit
    learned: LearnedRegions
    gain: float  # how much more probable it is so than as it was found [nat]


def follow_back(
    fitter: Fitter,
    limb: NDArray[np.int64],
    newest: tuple[Frames, Pose],
    earlier: Iterable[tuple[Frames, Pose]],
    *,
    appearance: Appearance,
    prior_of: PriorOf,
) -> list[BackwardFit]:
    """Follow a limb back through earlier times, the latest first; return those from which on it is better so."""
    past, path, gained = [(-newest[0].time_s, newest[1])], list[BackwardFit](), [0.0]
    for frames, found in earlier:
        step = _fit_back(fitter, limb, frames, found, past=past, appearance=appearance, prior_of=prior_of)
        if step is None:
            break
        if limb_distance(fitter.model, step.fit.pose, found, limb) < _MEET_M:
            gained[-1] += LOST_NATS * bool(path)
            break
        path.append(step)
        past.append((-frames.time_s, step.fit.pose))
        gained.append(gained[-1] + step.gain)
        if gained[-1] < max(gained) - _HOPELESS_NATS:
            break
    return path[: int(np.argmax(gained))]


def _fit_back(
    fitter: Fitter,
    limb: NDArray[np.int64],
    frames: Frames,
    found: Pose,
    *,
    past: predictors.PoseHistory,
    appearance: Appearance,
    prior_of: PriorOf,
) -> BackwardFit | None:
    expected = replace(found, joint_angles=with_limb(found, predictors.linear(past, -frames.time_s), limb))
    learned = regions_near(fitter, [expected, found], frames, appearance)
    if not learned.masks.regions:
        return None
    gap_s = float(-frames.time_s - past[-1][0])
    dofs = joints_of(fitter.model, limb)
    prior = prior_of(expected, gap_s)
    widened = None if prior is None else prior.widen(dofs.columns)
    start = fit_silhouettes(fitter.render_model, expected, learned.masks, levels=NEAR, dofs=dofs, prior=prior)
    there, here = fitter.fit_images([start], learned, prior), fitter.fit_images([found], learned, prior_of(found, 0.0))
    misfit = min(each.equations.misfit for each in (there, here))
    costs = [fitter.place_cost(each, learned, misfit, widened) for each in (here, there)]
    return BackwardFit(frames.index, there, learned, costs[0] - costs[1])
