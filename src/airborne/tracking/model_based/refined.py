"""`refined`, the default tracker: predict, choose, fit coarse to fine; search globally when the body was missed.

A rigid body has the six degrees of freedom of its root. A body with joints is fitted by `joint` (all of them at once),
`hierarchical` (the trunk first, then distally, as paper B plans), or `refined`: the second initialises the first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import body_like
from airborne.appearance.model import Appearance, Region
from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import delta_between, move_pose
from airborne.rendering import Lights
from airborne.tracking import predictors
from airborne.tracking.estimate import Estimate, Status, lost_estimate
from airborne.tracking.image_regions import crop_regions, reduce_frames, share_in_view
from airborne.tracking.model_based.degrees_of_freedom import (
    DegreesOfFreedom,
    PosePrior,
    all_joints,
    joints_of,
    proximal_to_distal,
    root_only,
)
from airborne.tracking.model_based.gauss_newton import (
    CLOSE,
    FAR,
    NEAR,
    Fit,
    PyramidLevels,
    fit_images,
    fit_silhouettes,
    linearise_images,
)
from airborne.tracking.model_based.global_search import SearchRange, region_evidence, search_globally
from airborne.tracking.model_based.left_right_swap import is_nearer, swap_limbs
from airborne.tracking.model_based.misplaced_limbs import find_misplaced_limbs, search_limb
from airborne.tracking.model_based.mixed_frames import blend_equations
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.status import MaskAgreement, Reference, mask_agreement, status_of
from airborne.types import Array
from airborne.video import Frames, View

Order = Literal["refined", "joint", "hierarchical"]

_MARGIN_PX, _FIRST_MARGIN_PX = 32, 56  # of a full frame
_MOST_PX_PER_M = 220.0  # of a body with joints
_HISTORY = 3  # poses that predict
_OBSERVED_SD_RAD, _UNOBSERVED_VARIANCE = 0.1, 1e6  # a rotation with a larger sd than this is hardly extrapolated
_FITTED_AFTER_SEARCH = 3  # best candidates of a search that are fitted
_LEAST_IN_VIEW = 0.4  # of the body, in the view that shows most of it; with less, the estimate is uncertain
_TRUNK_AT = 4  # images at this reduction show the limbs of a body with joints; more reduced ones, its trunk alone

PREDICTIONS: dict[str, tuple[Callable[[predictors.PoseHistory, Fraction], Pose], ...]] = {
    "smooth": (predictors.quadratic, predictors.linear),
    "ballistic": (predictors.ballistic, predictors.quadratic),
    "none": (predictors.constant,),
}
# sds of a predicted pose: at once, and its growth by unknown acceleration [per s²]
_EXPECTED_SD = (0.05, 30.0), (0.15, 150.0), (0.08, 120.0)  # root's position [m], root's rotation [rad], joints [rad]
_START_SD = (0.1, 0.3, 0.25)  # the same of a first pose set by hand: [m], [rad], [rad]


@dataclass(frozen=True, slots=True)
class RefinedState:
    """What the next frame needs."""

    past: tuple[tuple[Fraction, Pose], ...] = ()  # the last estimated poses, oldest first
    appearance: Appearance = field(default_factory=Appearance)
    reference: Reference = field(default_factory=Reference)
    covariance: Array | None = None  # of the last estimated pose


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
    ) -> None:
        self._render_model = RenderModel.of(model, lights)
        self._start = start
        self._posed_start = self._render_model.with_pose(start)
        self._predict = PREDICTIONS[prediction]
        self._is_jointed = len(model.segments) > 1 and not fixed_shape
        self._order = order
        self._root, self._stages = (
            root_only(model),
            proximal_to_distal(model) if self._is_jointed else [root_only(model)],
        )
        self._all = all_joints(model) if self._is_jointed else self._root

    def init(self) -> RefinedState:
        """Return the state before the first frame."""
        return RefinedState()

    def search(self, state: RefinedState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        frames, past = self._reduce_frames(frames), state.past
        poses = [predict(past, frames.time_s) for predict in self._predict] if past else [self._start]
        if past and self._is_jointed and state.covariance is not None:
            poses = [_shrink_unobserved(past[-1][1], pose, state.covariance) for pose in poses]
        prior = self._prior(poses[-1], float(frames.time_s - past[-1][0]) if past else None)
        fit, agreement = self._fit(poses, frames, state, prior, is_first=not past)
        if past and (agreement is None or agreement.is_suspect(state.reference)):
            search_range = SearchRange.after(float(frames.time_s - past[-1][0]))
            candidates = search_globally(self._render_model, poses, frames, state.appearance, search_range=search_range)
            again, agreement_again = self._fit(candidates, frames, state, None, n_fitted=_FITTED_AFTER_SEARCH)
            if agreement_again is not None and (agreement is None or agreement_again.evidence > agreement.evidence):
                fit, agreement = again, agreement_again
        return self._estimate(frames, fit, agreement, state.reference)

    def learn(self, state: RefinedState, frames: Frames, estimate: Estimate) -> RefinedState:
        """Return the state after the frames, given their estimate."""
        if estimate.pose is None:
            return state
        frames = self._reduce_frames(frames)
        past = (*state.past, (frames.time_s, estimate.pose))[-_HISTORY:]
        if estimate.status is not Status.TRACKED and state.past:
            return replace(state, past=past, covariance=estimate.covariance)
        body, appearance = self._render_model.with_pose(estimate.pose), state.appearance
        regions = crop_regions([body], self._render_model.geometry, frames, _MARGIN_PX)
        for region in regions:
            mask = self._render_model.draw_parts(body, region) >= 0
            appearance.learn_colours(region, mask)
            appearance.learn_background(region, mask)
        learned = [region for region in regions if appearance.has_colours(region)]
        agreement = mask_agreement(
            self._render_model, body, learned, [appearance.posterior(region) for region in learned]
        )
        reference = state.reference.update(agreement) if learned else state.reference
        return RefinedState(past, appearance, reference, estimate.covariance)

    def view_equations(self, state: RefinedState, frames: Frames, pose: Pose) -> dict[str, tuple[Array, Array]]:
        """Return the root's normal equations by each camera alone: camera -> curvature (6, 6), gradient (6,) [nat].

        The delta x (6,) of `airborne.body.chain` changes the log-likelihood by `gradient x - x curvature x / 2`.
        """
        frames, posed = self._reduce_frames(frames), self._render_model.with_pose(pose)
        regions = crop_regions([posed], self._render_model.geometry, frames, _MARGIN_PX)
        regions = [region for region in regions if state.appearance.has_colours(region)]
        with_backgrounds = self._with_backgrounds(state.appearance, posed, regions)
        equations = {}
        for region in regions:
            each = linearise_images(self._render_model, pose, [region], with_backgrounds, dofs=self._root)
            equations[region.camera.name] = each.A / each.noise, each.g / each.noise
        return equations

    def blend_equations(self, state: RefinedState, view: View, poses: Sequence[Pose]) -> tuple[Array, Array] | None:
        """Return the normal equations (m, m), (m,) for a view's shares of the body in m poses; None: not in view."""
        frames = self._reduce_frames(Frames(0, Fraction(0), (view,)))
        bodies = [self._render_model.with_pose(pose) for pose in poses]
        regions = crop_regions(bodies, self._render_model.geometry, frames, _MARGIN_PX)
        return blend_equations(self._render_model, state.appearance, regions[0], bodies) if regions else None

    def _reduce_frames(self, frames: Frames) -> Frames:
        """Reduce the images of a body with joints: finer ones show more detail than the model has."""
        return reduce_frames(frames, self._posed_start, _MOST_PX_PER_M) if self._is_jointed else frames

    def _estimate(
        self, frames: Frames, fit: Fit | None, agreement: MaskAgreement | None, reference: Reference
    ) -> Estimate:
        if fit is None or agreement is None:
            return lost_estimate(frames.index, frames.time_s)
        covariance = fit.covariance
        status = status_of(covariance, agreement, reference)
        if status is Status.LOST:
            return lost_estimate(frames.index, frames.time_s)
        if agreement.misplaced:
            limbs = joints_of(self._render_model.model, np.array(agreement.misplaced))
            covariance = _mark_unobserved(covariance, limbs.columns)
            status = status if reference.is_learned else Status.UNCERTAIN
        posed = self._render_model.with_pose(fit.pose)
        if share_in_view(posed, self._render_model.geometry, frames) < _LEAST_IN_VIEW:
            status = Status.UNCERTAIN
        return Estimate(
            index=frames.index,
            time_s=frames.time_s,
            status=status,
            score=fit.rms_light * 255,
            pose=fit.pose,
            covariance=covariance,
            n_views=agreement.n_views,
        )

    def _prior(self, expected: Pose, gap_s: float | None) -> PosePrior | None:
        """Return the prior about the predicted pose of a body with joints; a rigid body has none."""
        if not self._is_jointed:
            return None
        sds = _START_SD if gap_s is None else [now + 0.5 * later * gap_s**2 for now, later in _EXPECTED_SD]
        n_joints = len(self._render_model.model.segments) - 1
        return PosePrior(expected, np.repeat(np.minimum(sds, 1.5), [3, 3, 3 * n_joints]))

    def _fit(
        self,
        guesses: Sequence[Pose],
        frames: Frames,
        state: RefinedState,
        prior: PosePrior | None,
        *,
        is_first: bool = False,
        n_fitted: int = 1,
    ) -> tuple[Fit | None, MaskAgreement | None]:
        """Fit from the guesses of most evidence and return the best fit; (None, None) where no view shows any of them.

        With `n_fitted` above 1, every guess is first fitted to the silhouettes.
        """
        margin_px = _FIRST_MARGIN_PX if is_first else _MARGIN_PX
        bodies = [self._render_model.with_pose(guess) for guess in guesses]
        regions = crop_regions(bodies, self._render_model.geometry, frames, margin_px)
        appearance = state.appearance
        if is_first and regions:
            appearance = self._learn_first_colours(guesses[0], regions, prior)
        regions = [region for region in regions if appearance.has_colours(region)]
        if not regions:
            return None, None
        posteriors = [appearance.posterior(region) for region in regions]

        def agreement_of(pose: Pose) -> MaskAgreement:
            return mask_agreement(self._render_model, self._render_model.with_pose(pose), regions, posteriors)

        def fit_masks(pose: Pose, levels: PyramidLevels) -> Pose:
            return self._fit_silhouettes(pose, regions, posteriors, levels=levels, prior=prior)

        def fit_poses(poses: Sequence[Pose], prior: PosePrior | None = prior) -> Fit:
            with_backgrounds = self._with_backgrounds(appearance, self._render_model.with_pose(poses[0]), regions)
            return self._fit_images(poses, regions, with_backgrounds, prior)

        if n_fitted > 1:
            poses = [fit_masks(guess, NEAR) for guess in guesses]
            poses = sorted(poses, key=lambda pose: agreement_of(pose).evidence, reverse=True)[:n_fitted]
            fit = max((fit_poses([pose]) for pose in poses), key=lambda each: agreement_of(each.pose).evidence)
        elif is_first:
            poses = [fit_masks(pose, FAR) for pose in (guesses[0], *self._swap_limbs(guesses[0]))]
            fit = fit_poses([*poses, *self._swap_limbs(poses[0])])
        else:
            best = max(((guess, agreement_of(guess)) for guess in guesses), key=lambda each: each[1].evidence)
            fit = fit_poses(
                [fit_masks(best[0], NEAR if self._is_jointed or best[1].is_suspect(state.reference) else CLOSE)]
            )
            if swaps := [
                pose
                for pose in self._swap_limbs(fit.pose)
                if is_nearer(self._render_model.model, pose, fit.pose, best[0])
            ]:
                fit = fit_poses([fit.pose, *swaps])
        misplaced: list[NDArray[np.int64]] = []
        if self._is_jointed:
            fit = self._refit_misplaced_limbs(fit, guesses, regions, posteriors, fit_poses=fit_poses, prior=prior)
            misplaced = find_misplaced_limbs(self._render_model, fit.pose, regions, posteriors)
        return fit, replace(agreement_of(fit.pose), misplaced=tuple(int(i) for limb in misplaced for i in limb))

    def _refit_misplaced_limbs(
        self,
        fit: Fit,
        guesses: Sequence[Pose],
        regions: Sequence[Region],
        posteriors: Sequence[Array],
        *,
        fit_poses: Callable[[Sequence[Pose], PosePrior | None], Fit],
        prior: PosePrior | None,
    ) -> Fit:
        """Search for each limb that covers pixels unlike the body; return the pose that fits the images best."""
        maps = None
        for limb in find_misplaced_limbs(self._render_model, fit.pose, regions, posteriors):
            maps = maps or region_evidence(regions, posteriors)
            expected = [replace(fit.pose, joint_angles=_with_limb(fit.pose, guess, limb)) for guess in guesses]
            poses = search_limb(self._render_model, [fit.pose, *expected], limb, maps)
            dofs = joints_of(self._render_model.model, limb)
            poses = [
                fit_silhouettes(self._render_model, pose, regions, posteriors, levels=NEAR, dofs=dofs) for pose in poses
            ]
            fit = fit_poses([fit.pose, *poses], None if prior is None else prior.widen(dofs.columns))
        return fit

    def _swap_limbs(self, pose: Pose) -> list[Pose]:
        """Return the poses with a pair of limbs swapped; none for a rigid body."""
        return swap_limbs(self._render_model.model, pose) if self._is_jointed else []

    def _fit_silhouettes(
        self,
        pose: Pose,
        regions: Sequence[Region],
        posteriors: Sequence[Array],
        *,
        levels: PyramidLevels,
        prior: PosePrior | None,
    ) -> Pose:
        """Fit the masks level by level: on the coarser ones, the trunk first."""
        trunk = self._stages[0]
        for level in levels:
            if self._is_jointed and self._order != "joint" and level[0] >= _TRUNK_AT:
                pose = fit_silhouettes(
                    self._render_model, pose, regions, posteriors, levels=[level], dofs=trunk, prior=prior
                )
            if not self._is_jointed or self._order == "joint" or level[0] <= _TRUNK_AT:
                pose = fit_silhouettes(
                    self._render_model, pose, regions, posteriors, levels=[level], dofs=self._all, prior=prior
                )
        return pose

    def _fit_images(
        self, poses: Sequence[Pose], regions: Sequence[Region], appearance: Appearance, prior: PosePrior | None
    ) -> Fit:
        stages: Sequence[DegreesOfFreedom] = [self._all]
        if self._is_jointed and self._order == "hierarchical":
            stages = self._stages
        fits = []
        for dofs in stages:
            fits.append(fit_images(self._render_model, poses, regions, appearance, dofs=dofs, prior=prior))
            poses = [fits[-1].pose]
        return fits[-1]

    def _learn_first_colours(self, pose: Pose, regions: Sequence[Region], prior: PosePrior | None) -> Appearance:
        """Learn the colours from a pose set by hand, correct the pose by them, and learn them again.

        The first time, pixels of the mask that are more like the background than like the body's own colours are left
        out: the pose may be wrong by more than the body's width.
        """
        for iteration in range(3):
            appearance = Appearance()
            posed = self._render_model.with_pose(pose)
            for region in regions:
                part = self._render_model.draw_parts(posed, region)
                body = body_like(region.rgb, part, self._render_model.geometry.colours) if iteration == 0 else None
                appearance.learn_colours(region, part >= 0, body=body)
            learned = [region for region in regions if appearance.has_colours(region)]
            posteriors = [appearance.posterior(region) for region in learned]
            pose = self._fit_silhouettes(pose, learned, posteriors, levels=FAR, prior=prior)
        return appearance

    def _with_backgrounds(self, appearance: Appearance, posed: PosedBody, regions: Sequence[Region]) -> Appearance:
        """Give every region a background model: where none has been learned, this image outside the mask."""
        missing = [region for region in regions if region.source not in appearance.backgrounds]
        if not missing:
            return appearance
        supplemented = Appearance(
            appearance.body_histograms, appearance.background_histograms, dict(appearance.backgrounds)
        )
        for region in missing:
            supplemented.learn_background(region, self._render_model.draw_parts(posed, region) >= 0)
        return supplemented


def _with_limb(pose: Pose, other: Pose, limb: NDArray[np.int64]) -> Array:
    """Return the joint angles of a pose, with one limb's from another pose."""
    angles = pose.joint_angles.copy()
    angles[limb - 1] = other.joint_angles[limb - 1]
    return angles


def _shrink_unobserved(last: Pose, predicted: Pose, covariance: Array) -> Pose:
    """Shrink the predicted rotations of root and joints by how well they were observed: unobserved ones stay.

    A joint's rotation vector with covariance C is multiplied by S (S + C)^-1, S = _OBSERVED_SD_RAD^2.
    """
    delta = delta_between(last, predicted)
    rotations = delta[3:].reshape(-1, 3)
    first = 3 + 3 * np.arange(len(rotations))[:, None] + np.arange(3)
    C = np.nan_to_num(covariance[first[:, :, None], first[:, None, :]], posinf=_UNOBSERVED_VARIANCE)
    S = _OBSERVED_SD_RAD**2 * np.eye(3)
    delta[3:] = (S @ np.linalg.solve(S + C, rotations[..., None]))[..., 0].ravel()
    return move_pose(last, delta)


def _mark_unobserved(covariance: Array, columns: NDArray[np.integer]) -> Array:
    """Return a covariance in which some degrees of freedom are unobserved: infinite."""
    covariance = covariance.copy()
    covariance[columns] = covariance[:, columns] = 0
    covariance[columns, columns] = np.inf
    return covariance
