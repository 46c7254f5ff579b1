"""`refined`, the default tracker: predict, fit coarse to fine; search globally when the body was missed.

A rigid body has the six degrees of freedom of its root. A body with joints is fitted by `joint` (all of them at once),
`hierarchical` (the trunk first, then distally, as paper B plans), or `refined`: the second initialises the first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance, Region
from airborne.body import BodyModel, Pose
from airborne.rendering import Lights
from airborne.tracking import predictors
from airborne.tracking.estimate import Doubt, Estimate, Status, has_unknown_limb, lost_estimate
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.first_pose.evidence_fit import join_evidence
from airborne.tracking.image_regions import crop_regions, reduce_frames, share_in_view
from airborne.tracking.model_based.degrees_of_freedom import FIRST_POSE_SD, WIDE_SD, PosePrior, joints_of
from airborne.tracking.model_based.exposure import Extrapolation, fit_exposed
from airborne.tracking.model_based.first_frame import fit_first
from airborne.tracking.model_based.fitter import Fitter, JudgedFit, Order
from airborne.tracking.model_based.image_evidence import ImageEvidence, linearise_evidence
from airborne.tracking.model_based.later_frames import MARGIN_PX, fit_next, is_same, regions_near
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.learning import learn_appearance
from airborne.tracking.model_based.lens_blur import learn_blurs
from airborne.tracking.model_based.misplaced_limbs import is_same_place
from airborne.tracking.model_based.recovery import recover
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.status import Reference, doubts_of, is_lost
from airborne.tracking.model_based.support import mark_unobserved, shrink_unobserved, widen_unseen
from airborne.types import Array
from airborne.video import Frames

_MOST_PX_PER_M = 220.0  # of a body with joints
_HISTORY = 3  # poses that predict
# share of the reference's precision and recall from which colours and backgrounds are learned in turns; if they always
# are, light that doubles within twelve frames is lost
_STEADY = 0.98
_BLUR_FRAMES = 2  # that tell how sharp the images are: on synthetic throws four tell no more, the first alone less
_LEAST_IN_VIEW = 0.4  # of the body, in the view that shows most of it; with less, the estimate is uncertain

PREDICTIONS: dict[str, tuple[Callable[[predictors.PoseHistory, Fraction], Pose], ...]] = {
    "smooth": (predictors.quadratic, predictors.linear),
    "ballistic": (predictors.ballistic, predictors.quadratic),
    "none": (predictors.constant,),
}
# sds of a predicted pose: at once, and its growth by unknown acceleration [per s²]
_EXPECTED_SD = (0.05, 30.0), (0.15, 150.0), (0.08, 120.0)  # root's position [m], root's rotation [rad], joints [rad]


@dataclass(frozen=True, slots=True, eq=False)
class RefinedState:
    """What the next frame needs."""

    past: predictors.PoseHistory = ()  # the last estimated poses, oldest first
    appearance: Appearance = field(default_factory=Appearance)
    reference: Reference = field(default_factory=Reference)
    covariance: Array | None = None  # of the last estimated pose
    n_learned: int = 0  # from how many frames was learned
    other_direction: Mapping[int, Estimate] = field(default_factory=dict)  # by frame, of the other direction of time


class RefinedTracker:
    """Track by Gauss-Newton on the images of all cameras; see `gauss_newton`."""

    def __init__(
        self,
        model: BodyModel,
        start: Pose,
        *,
        prediction: str = "smooth",
        lights: Lights | None = None,
        order: Order = "refined",
        fixed_shape: bool = False,
        keys: Mapping[int, PoseEvidence] | None = None,
    ) -> None:
        self.render_model = RenderModel.of(model, lights)
        self._fitter = Fitter.of(self.render_model, order, fixed_shape=fixed_shape)
        self._start, self._posed_start = start, self.render_model.with_pose(start)
        self._predict = PREDICTIONS[prediction]
        self._keys = keys or {}

    @property
    def moves_joints(self) -> bool:
        """Whether more than the root is tracked, so that limbs may be lost."""
        return self._fitter.moves_joints

    def init(self) -> RefinedState:
        """Return the state before the first frame."""
        return RefinedState()

    def search(self, state: RefinedState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        frames = self.reduce_frames(frames)
        known = state.other_direction.get(frames.index)
        if frames.index in self._keys:
            found = self._search_at_key(state, frames, self._keys[frames.index])
        elif known is not None and self._is_expected(state, known):
            return known
        elif not state.past:
            found = self._search_first(frames)
        else:
            found = self._search_later(state, frames, None if known is None else known.pose)
        if found is not None and state.past and not self._fitter.moves_joints:
            found = replace(found, fit=fit_exposed(self.render_model, found.fit, self._motion(state.past, frames)))
        return self._estimate(frames, found, state.reference)

    def learn(self, state: RefinedState, frames: Frames, estimate: Estimate) -> RefinedState:
        """Return the state after the frames, given their estimate."""
        if estimate.pose is None:
            return state
        frames, before = self.reduce_frames(frames), state.past
        if frames.index in self._keys and before:
            before = predictors.correct_past(before, frames.time_s, estimate.pose)
        past = (*before, (frames.time_s, estimate.pose))[-_HISTORY:]
        if estimate.status is not Status.TRACKED and state.past:
            return replace(state, past=past, covariance=estimate.covariance)
        posed = self.render_model.with_pose(estimate.pose)
        regions = crop_regions([posed], self.render_model.geometry, frames, MARGIN_PX, state.appearance)
        motion = self._motion(before, frames)
        shares = estimate.mask_shares or self._mask_shares(estimate.pose, regions, state.appearance)  # rows have none
        is_steady = bool(state.past) and state.reference.is_met(shares, _STEADY)
        turn = state.n_learned // 2 % 2  # twice each: the two backgrounds of fields take turns, too
        appearance = learn_appearance(
            self.render_model,
            estimate.pose,
            regions,
            state.appearance,
            motion=motion,
            colours=turn == 1 or not is_steady,
            backgrounds=turn == 0 or not is_steady,
        )
        if state.n_learned < _BLUR_FRAMES and not self.moves_joints:
            appearance = learn_blurs(
                self.render_model, estimate.pose, regions, appearance, motion=motion if before else None
            )
        if not state.past:  # nothing was known of colours before
            shares = self._mask_shares(estimate.pose, regions, appearance)
        reference = state.reference.update(*shares) if shares else state.reference
        return replace(
            state,
            past=past,
            appearance=appearance,
            reference=reference,
            covariance=estimate.covariance,
            n_learned=state.n_learned + 1,
        )

    def _mask_shares(self, pose: Pose, regions: Sequence[Region], known: Appearance) -> tuple[float, float] | None:
        """Return precision and recall of a pose's mask; None where no region's colours have been learned."""
        learned = LearnedRegions.of(regions, known)
        return self._fitter.agreement(pose, learned).shares if learned.masks.regions else None

    def turn(self, state: RefinedState, forward: Mapping[int, Estimate]) -> RefinedState:
        """Return the state from which the body is tracked back in time: the past is as it would be met then.

        What was found forward in time is taken where it is expected on the way back and nothing is in doubt. Where both
        directions find the same pose, no limb is searched for again.
        """
        return replace(state, past=predictors.turn_past(state.past), other_direction=forward)

    def weigh(self, state: RefinedState, frames: Frames, poses: Sequence[Pose]) -> Array:
        """Return minus the log-likelihood of the images in each of several poses: (n,) [nat]."""
        frames = self.reduce_frames(frames)
        learned = regions_near(self._fitter, poses, frames, state.appearance)
        return self._fitter.weigh(poses, learned) if learned.masks.regions else np.zeros(len(poses))

    def assess(self, state: RefinedState, frames: Frames, pose: Pose) -> Estimate:
        """Return what the images of a time say of a pose that those of other times confirm."""
        frames = self.reduce_frames(frames)
        learned = regions_near(self._fitter, [pose], frames, state.appearance)
        judged = self._fitter.judge_pose(pose, learned) if learned.masks.regions else None
        return self._estimate(frames, judged, state.reference)

    def linearise(
        self,
        state: RefinedState,
        frames: Frames,
        pose: Pose,
        misfit: float | None = None,
        *,
        surface: RenderModel | None = None,
        shown: NDArray[np.bool_] | None = None,
    ) -> ImageEvidence:
        """Return what the images say about a pose of the body, or of another surface; see `linearise_evidence`."""
        args = surface or self.render_model, pose, self.reduce_frames(frames), state.appearance
        return linearise_evidence(*args, model=self._fitter.model, misfit=misfit, shown=shown)

    def reduce_frames(self, frames: Frames) -> Frames:
        """Reduce the images of a body whose joints move: finer ones show more detail than the model has."""
        return reduce_frames(frames, self._posed_start, _MOST_PX_PER_M) if self._fitter.moves_joints else frames

    def _search_first(self, frames: Frames) -> JudgedFit | None:
        return fit_first(self._fitter, self._start, frames, self._prior(self._start, FIRST_POSE_SD))

    def _is_expected(self, state: RefinedState, known: Estimate) -> bool:
        """Whether an estimate leaves nothing in doubt, and the body was to be expected there."""
        if known.pose is None or known.status is not Status.TRACKED or has_unknown_limb(known, self._fitter.model):
            return False
        expected = self._predict[0](state.past, known.time_s)
        return is_same_place(self._fitter.model, expected, known.pose)

    def _search_later(self, state: RefinedState, frames: Frames, searched: Pose | None) -> JudgedFit | None:
        last_s, last = state.past[-1]
        gap_s = float(frames.time_s - last_s)
        predicted = [predict(state.past, frames.time_s) for predict in self._predict]
        if self._fitter.moves_joints and state.covariance is not None:
            predicted = [shrink_unobserved(last, pose, state.covariance) for pose in predicted]
        prior = self._prior_after(predicted[-1], gap_s)
        args = self._fitter, predicted, frames, state.appearance
        found = fit_next(*args, reference=state.reference, prior=prior, searched=searched)
        if found is not None and not found.agreement.is_suspect(state.reference):
            return found
        suspect = None
        if found is not None:
            is_poor = found.agreement.is_poor(state.reference)
            is_expected = any(is_same(found.fit.pose, pose) for pose in predicted)
            if is_expected and not is_poor:
                return found
            suspect = found.fit.pose if is_expected or not is_poor else None
        recovered = recover(*args, gap_s=gap_s, suspect=suspect)
        if found is None or recovered is None:
            return found or recovered
        return recovered if recovered.agreement.evidence > found.agreement.evidence else found

    def _motion(self, past: predictors.PoseHistory, frames: Frames) -> Extrapolation:
        """Return how the body moves about the time of some frames, by where it was before."""
        return lambda pose, s: self._predict[0]((*past, (frames.time_s, pose)), frames.time_s + Fraction(s))

    def _search_at_key(self, state: RefinedState, frames: Frames, evidence: PoseEvidence) -> JudgedFit | None:
        """Fit from the pose that the evidence gives, which a lost limb's prediction cannot hold back."""
        if not state.past:
            pose = join_evidence(self._start, self._repeat(np.full(3, WIDE_SD)), evidence)
            return fit_first(self._fitter, pose, frames, PosePrior(pose, self._repeat(FIRST_POSE_SD), evidence))
        gap_s = float(frames.time_s - state.past[-1][0])
        expected = predictors.linear(state.past, frames.time_s)
        grown = [now + 0.5 * later * gap_s**2 for now, later in _EXPECTED_SD]
        sds = self._repeat(np.maximum(FIRST_POSE_SD, grown))
        pose = join_evidence(expected, sds, evidence)
        prior = PosePrior(pose, sds, evidence)
        return fit_next(self._fitter, [pose], frames, state.appearance, reference=state.reference, prior=prior)

    def _estimate(self, frames: Frames, found: JudgedFit | None, reference: Reference) -> Estimate:
        if found is None:
            return lost_estimate(frames.index, frames.time_s)
        fit, agreement = found.fit, found.agreement
        if is_lost(agreement, reference):
            return lost_estimate(frames.index, frames.time_s)
        covariance = fit.covariance
        doubts = list(doubts_of(covariance, agreement, reference))
        if agreement.misplaced:
            limbs = joints_of(self._fitter.model, np.array(agreement.misplaced))
            covariance = mark_unobserved(covariance, limbs.columns)
        if agreement.n_views_of is not None:
            covariance = widen_unseen(covariance, self._fitter.model, agreement.n_views_of)
        if frames.index in self._keys:
            covariance = self._keys[frames.index].add_to(covariance, fit.pose)
        posed = self.render_model.with_pose(fit.pose)
        if share_in_view(posed, self.render_model.geometry, frames) < _LEAST_IN_VIEW:
            doubts.append(Doubt.VIEW)
        return Estimate(
            index=frames.index,
            time_s=frames.time_s,
            status=Status.UNCERTAIN if doubts else Status.TRACKED,
            doubts=tuple(doubts),
            score=fit.rms_light * 255,
            pose=fit.pose,
            covariance=covariance,
            n_views=agreement.n_views,
            mask_shares=agreement.shares,
        )

    def _prior_after(self, expected: Pose, gap_s: float) -> PosePrior | None:
        """Return the prior about a pose that was predicted over a gap."""
        return self._prior(expected, [now + 0.5 * later * gap_s**2 for now, later in _EXPECTED_SD])

    def _prior(self, expected: Pose, sds: Sequence[float]) -> PosePrior | None:
        """Return the prior about an expected pose where joints move, by the sds of `_EXPECTED_SD`; None elsewhere."""
        if not self._fitter.moves_joints:
            return None
        return PosePrior(expected, self._repeat(sds))

    def _repeat(self, sds: Sequence[float] | Array) -> Array:
        """Return the sds of position, rotation and joints for every degree of freedom: (6 + 3 joints,)."""
        return np.repeat(np.minimum(sds, WIDE_SD), [3, 3, 3 * self._fitter.model.n_joints])
