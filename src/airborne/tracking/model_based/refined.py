"""`refined`, the default tracker: predict, choose, fit coarse to fine; search widely when the body was missed.

A body in one piece moves by its root. A body with joints is fitted by `joint` (all degrees of freedom at once),
`hierarchical` (the trunk first, then outward, as paper B plans), or `refined`: the second feeding the first.
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
from airborne.body.chain import motion_between, moved_pose
from airborne.rendering import Lights
from airborne.tracking import predictors
from airborne.tracking.estimate import Estimate, Status, lost
from airborne.tracking.image_regions import reduced, regions_round, share_in_pictures
from airborne.tracking.model_based.degrees_of_freedom import Freedom, Prior, all_joints, only, outward, root_only
from airborne.tracking.model_based.gauss_newton import (
    CLOSE,
    FAR,
    NEAR,
    Fit,
    Levels,
    evaluate_pictures,
    fit_pictures,
    fit_silhouettes,
)
from airborne.tracking.model_based.global_search import Reach, evidence_of, search_widely
from airborne.tracking.model_based.left_right_swap import is_nearer, swapped
from airborne.tracking.model_based.misplaced_limbs import astray, look_for
from airborne.tracking.model_based.mixed_frames import moment_equations
from airborne.tracking.model_based.render_model import Synthesis
from airborne.tracking.model_based.status import Agreement, Usual, agreement, status_of
from airborne.video import Frames, View

Array = NDArray[np.floating]
Order = Literal["refined", "joint", "hierarchical"]

_MARGIN_PX, _FIRST_MARGIN_PX = 32, 56  # of a full frame
_MOST_PX_PER_M = 220.0  # of a body with joints
_REMEMBERED = 3
_SEEN_SD_RAD, _UNSEEN_VARIANCE = 0.1, 1e6  # a turn known less well than this is not extrapolated
_FITTED_AFTER_SEARCH = 3
_LEAST_IN_PICTURES = 0.4  # of the body, in the view that holds most of it; less is not enough to be sure
_TRUNK_AT = 4  # pictures reduced so far show the limbs of a body with joints, those reduced farther its trunk alone

PREDICTIONS: dict[str, tuple[Callable[[predictors.Past, Fraction], Pose], ...]] = {
    "smooth": (predictors.quadratic, predictors.linear),
    "ballistic": (predictors.ballistic, predictors.quadratic),
    "none": (predictors.stay,),
}
# how well a pose is expected: at once, and after a second's square of unknown acceleration
_EXPECTED_SD = (0.05, 30.0), (0.15, 150.0), (0.08, 120.0)  # root's place [m], root's turn [rad], joints [rad]
_START_SD = (0.1, 0.3, 0.25)  # of a first pose set by hand: [m], [rad], [rad]


@dataclass(frozen=True, slots=True)
class RefinedState:
    """What the next frame needs."""

    past: tuple[tuple[Fraction, Pose], ...] = ()  # the last poses found, oldest first
    appearance: Appearance = field(default_factory=Appearance)
    usual: Usual = field(default_factory=Usual)
    covariance: Array | None = None  # of the last pose found


class Refined:
    """Track by Gauss-Newton on all cameras' pictures; see `gauss_newton`."""

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
        self._synthesis = Synthesis.of(model, lights)
        self._start = start
        self._placed_start = self._synthesis.place(start)
        self._predict = PREDICTIONS[prediction]
        self._is_jointed = len(model.segments) > 1 and not fixed_shape
        self._order = order
        self._root, self._stages = root_only(model), outward(model) if self._is_jointed else [root_only(model)]
        self._all = all_joints(model) if self._is_jointed else self._root

    def init(self) -> RefinedState:
        """Return the state before the first frame."""
        return RefinedState()

    def search(self, state: RefinedState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        frames, past = self._as_tracked(frames), state.past
        poses = [predict(past, frames.time_s) for predict in self._predict] if past else [self._start]
        if past and self._is_jointed and state.covariance is not None:
            poses = [_as_far_as_seen(past[-1][1], pose, state.covariance) for pose in poses]
        prior = self._prior(poses[-1], float(frames.time_s - past[-1][0]) if past else None)
        fit, agreed = self._fit(poses, frames, state, prior, is_first=not past)
        if past and (agreed is None or agreed.is_suspect(state.usual)):
            reach = Reach.after(float(frames.time_s - past[-1][0]))
            wide = search_widely(self._synthesis, poses, frames, state.appearance, reach)
            again, agreed_again = self._fit(wide, frames, state, None, n_fitted=_FITTED_AFTER_SEARCH)
            if agreed_again is not None and (agreed is None or agreed_again.evidence > agreed.evidence):
                fit, agreed = again, agreed_again
        return self._estimate(frames, fit, agreed, state.usual)

    def learn(self, state: RefinedState, frames: Frames, estimate: Estimate) -> RefinedState:
        """Return the state after the frames, given where the body was found."""
        if estimate.pose is None:
            return state
        frames = self._as_tracked(frames)
        past = (*state.past, (frames.time_s, estimate.pose))[-_REMEMBERED:]
        if estimate.status is not Status.TRACKED and state.past:
            return replace(state, past=past, covariance=estimate.covariance)
        body, appearance = self._synthesis.place(estimate.pose), state.appearance
        regions = regions_round([body], self._synthesis.geometry, frames, _MARGIN_PX)
        for region in regions:
            mask = self._synthesis.parts(body, region) >= 0
            appearance.learn_colours(region, mask)
            appearance.learn_scene(region, mask)
        known = [region for region in regions if appearance.knows(region)]
        agreed = agreement(self._synthesis, body, known, [appearance.posterior(region) for region in known])
        usual = state.usual.learned(agreed) if known else state.usual
        return RefinedState(past, appearance, usual, estimate.covariance)

    def by_view(self, state: RefinedState, frames: Frames, pose: Pose) -> dict[str, tuple[Array, Array]]:
        """Say which way each camera alone would move the root: camera -> curvature (6, 6), slope (6,) [nat].

        The motion x (6,) of `airborne.body.chain` changes the log-likelihood by `slope x - x curvature x / 2`.
        """
        frames, posed = self._as_tracked(frames), self._synthesis.place(pose)
        regions = regions_round([posed], self._synthesis.geometry, frames, _MARGIN_PX)
        regions = [region for region in regions if state.appearance.knows(region)]
        scenes = self._with_scenes(state.appearance, posed, regions)
        found = {}
        for region in regions:
            each = evaluate_pictures(self._synthesis, pose, [region], scenes, self._root)
            found[region.camera.name] = each.A / each.noise, each.g / each.noise
        return found

    def by_moment(self, state: RefinedState, view: View, poses: Sequence[Pose]) -> tuple[Array, Array] | None:
        """Say how much of the body in m poses each a view shows: normal equations (m, m), (m,); None: not in view."""
        frames = self._as_tracked(Frames(0, Fraction(0), (view,)))
        bodies = [self._synthesis.place(pose) for pose in poses]
        regions = regions_round(bodies, self._synthesis.geometry, frames, _MARGIN_PX)
        return moment_equations(self._synthesis, state.appearance, regions[0], bodies) if regions else None

    def _as_tracked(self, frames: Frames) -> Frames:
        """Reduce the pictures of a body with joints: its many pixels say more than its shape can follow."""
        return reduced(frames, self._placed_start, _MOST_PX_PER_M) if self._is_jointed else frames

    def _estimate(self, frames: Frames, fit: Fit | None, agreed: Agreement | None, usual: Usual) -> Estimate:
        if fit is None or agreed is None:
            return lost(frames.index, frames.time_s)
        covariance = fit.covariance
        status = status_of(covariance, agreed, usual)
        if status is Status.LOST:
            return lost(frames.index, frames.time_s)
        if agreed.astray:
            covariance = _unknown(covariance, only(self._synthesis.model, np.array(agreed.astray)).columns)
            status = status if usual.is_learned else Status.UNCERTAIN
        posed = self._synthesis.place(fit.pose)
        if share_in_pictures(posed, self._synthesis.geometry, frames) < _LEAST_IN_PICTURES:
            status = Status.UNCERTAIN
        return Estimate(
            index=frames.index,
            time_s=frames.time_s,
            status=status,
            score=fit.rms_light * 255,
            pose=fit.pose,
            covariance=covariance,
            n_views=agreed.n_views,
        )

    def _prior(self, expected: Pose, gap_s: float | None) -> Prior | None:
        """Say how well a body with joints is expected where it is predicted; one in one piece is free."""
        if not self._is_jointed:
            return None
        sds = _START_SD if gap_s is None else [now + 0.5 * later * gap_s**2 for now, later in _EXPECTED_SD]
        n_joints = len(self._synthesis.model.segments) - 1
        return Prior(expected, np.repeat(np.minimum(sds, 1.5), [3, 3, 3 * n_joints]))

    def _fit(
        self,
        guesses: Sequence[Pose],
        frames: Frames,
        state: RefinedState,
        prior: Prior | None,
        *,
        is_first: bool = False,
        n_fitted: int = 1,
    ) -> tuple[Fit | None, Agreement | None]:
        """Fit from the guesses that the pictures like best, and keep the best fit; (None, None) where no view sees any.

        With `n_fitted` above 1, every guess is first fitted to the silhouettes.
        """
        margin_px = _FIRST_MARGIN_PX if is_first else _MARGIN_PX
        bodies = [self._synthesis.place(guess) for guess in guesses]
        regions = regions_round(bodies, self._synthesis.geometry, frames, margin_px)
        appearance = state.appearance
        if is_first and regions:
            appearance = self._first_look(guesses[0], regions, prior)
        regions = [region for region in regions if appearance.knows(region)]
        if not regions:
            return None, None
        posteriors = [appearance.posterior(region) for region in regions]

        def agreed(pose: Pose) -> Agreement:
            return agreement(self._synthesis, self._synthesis.place(pose), regions, posteriors)

        def to_silhouettes(pose: Pose, levels: Levels) -> Pose:
            return self._to_silhouettes(pose, regions, posteriors, levels, prior)

        def to_pictures(poses: Sequence[Pose], prior: Prior | None = prior) -> Fit:
            scenes = self._with_scenes(appearance, self._synthesis.place(poses[0]), regions)
            return self._to_pictures(poses, regions, scenes, prior)

        if n_fitted > 1:
            poses = [to_silhouettes(guess, NEAR) for guess in guesses]
            poses = sorted(poses, key=lambda pose: agreed(pose).evidence, reverse=True)[:n_fitted]
            fit = max((to_pictures([pose]) for pose in poses), key=lambda each: agreed(each.pose).evidence)
        elif is_first:
            poses = [to_silhouettes(pose, FAR) for pose in (guesses[0], *self._swapped(guesses[0]))]
            fit = to_pictures([*poses, *self._swapped(poses[0])])
        else:
            best = max(((guess, agreed(guess)) for guess in guesses), key=lambda each: each[1].evidence)
            fit = to_pictures(
                [to_silhouettes(best[0], NEAR if self._is_jointed or best[1].is_suspect(state.usual) else CLOSE)]
            )
            if swaps := [
                pose for pose in self._swapped(fit.pose) if is_nearer(self._synthesis.model, pose, fit.pose, best[0])
            ]:
                fit = to_pictures([fit.pose, *swaps])
        strays: list[NDArray[np.int64]] = []
        if self._is_jointed:
            fit = self._with_limbs_found(fit, guesses, regions, posteriors, to_pictures, prior)
            strays = astray(self._synthesis, fit.pose, regions, posteriors)
        return fit, replace(agreed(fit.pose), astray=tuple(int(i) for limb in strays for i in limb))

    def _with_limbs_found(
        self,
        fit: Fit,
        guesses: Sequence[Pose],
        regions: Sequence[Region],
        posteriors: Sequence[Array],
        to_pictures: Callable[[Sequence[Pose], Prior | None], Fit],
        prior: Prior | None,
    ) -> Fit:
        """Look for each limb that lies on pixels unlike the body; keep what the pictures like better."""
        maps = None
        for limb in astray(self._synthesis, fit.pose, regions, posteriors):
            maps = maps or evidence_of(regions, posteriors)
            expected = [replace(fit.pose, joint_angles=_with_limb(fit.pose, guess, limb)) for guess in guesses]
            found = look_for(self._synthesis, [fit.pose, *expected], limb, maps)
            freedom = only(self._synthesis.model, limb)
            found = [fit_silhouettes(self._synthesis, pose, regions, posteriors, NEAR, freedom) for pose in found]
            fit = to_pictures([fit.pose, *found], None if prior is None else prior.loosened(freedom.columns))
        return fit

    def _swapped(self, pose: Pose) -> list[Pose]:
        """Return the poses with the limbs of one side in the places of the other's; none for a body in one piece."""
        return swapped(self._synthesis.model, pose) if self._is_jointed else []

    def _to_silhouettes(
        self, pose: Pose, regions: Sequence[Region], posteriors: Sequence[Array], levels: Levels, prior: Prior | None
    ) -> Pose:
        """Fit the masks level by level: on the coarser ones the trunk goes first."""
        for level in levels:
            if self._is_jointed and self._order != "joint" and level[0] >= _TRUNK_AT:
                pose = fit_silhouettes(self._synthesis, pose, regions, posteriors, [level], self._stages[0], prior)
            if not self._is_jointed or self._order == "joint" or level[0] <= _TRUNK_AT:
                pose = fit_silhouettes(self._synthesis, pose, regions, posteriors, [level], self._all, prior)
        return pose

    def _to_pictures(
        self, poses: Sequence[Pose], regions: Sequence[Region], appearance: Appearance, prior: Prior | None
    ) -> Fit:
        stages: Sequence[Freedom] = [self._all]
        if self._is_jointed and self._order == "hierarchical":
            stages = self._stages
        fits = []
        for freedom in stages:
            fits.append(fit_pictures(self._synthesis, poses, regions, appearance, freedom, prior))
            poses = [fits[-1].pose]
        return fits[-1]

    def _first_look(self, pose: Pose, regions: Sequence[Region], prior: Prior | None) -> Appearance:
        """Learn the colours from a pose set by hand, mend the pose by them, and learn them again.

        The first time, pixels of the mask that are more like the background than like the body's own colours are left
        out: the pose may be off by more than the body is wide.
        """
        for look in range(3):
            appearance = Appearance()
            posed = self._synthesis.place(pose)
            for region in regions:
                part = self._synthesis.parts(posed, region)
                body = body_like(region.rgb, part, self._synthesis.geometry.colours) if look == 0 else None
                appearance.learn_colours(region, part >= 0, body=body)
            known = [region for region in regions if appearance.knows(region)]
            posteriors = [appearance.posterior(region) for region in known]
            pose = self._to_silhouettes(pose, known, posteriors, FAR, prior)
        return appearance

    def _with_scenes(self, appearance: Appearance, posed: PosedBody, regions: Sequence[Region]) -> Appearance:
        """Give every region an empty scene to compare with: where none is known yet, this picture outside the mask."""
        unknown = [region for region in regions if region.source not in appearance.plates]
        if not unknown:
            return appearance
        supplemented = Appearance(appearance.body, appearance.background, dict(appearance.plates))
        for region in unknown:
            supplemented.learn_scene(region, self._synthesis.parts(posed, region) >= 0)
        return supplemented


def _with_limb(pose: Pose, other: Pose, limb: NDArray[np.int64]) -> Array:
    """Return the joint angles of a pose with one limb's taken from another."""
    angles = pose.joint_angles.copy()
    angles[limb - 1] = other.joint_angles[limb - 1]
    return angles


def _as_far_as_seen(last: Pose, predicted: Pose, covariance: Array) -> Pose:
    """Turn root and joints on only as far as their turns were seen: what cannot be seen stays put.

    A turn of a joint, with covariance C over its three axes, goes on by S (S + C)^-1 of what it would, S = _SEEN_SD^2.
    """
    motion = motion_between(last, predicted)
    turns = motion[3:].reshape(-1, 3)
    first = 3 + 3 * np.arange(len(turns))[:, None] + np.arange(3)
    C = np.nan_to_num(covariance[first[:, :, None], first[:, None, :]], posinf=_UNSEEN_VARIANCE)
    S = _SEEN_SD_RAD**2 * np.eye(3)
    motion[3:] = (S @ np.linalg.solve(S + C, turns[..., None]))[..., 0].ravel()
    return moved_pose(last, motion)


def _unknown(covariance: Array, columns: NDArray[np.integer]) -> Array:
    """Return a covariance in which some degrees of freedom are not known."""
    covariance = covariance.copy()
    covariance[columns] = covariance[:, columns] = 0
    covariance[columns, columns] = np.inf
    return covariance
