"""`refined`, the default tracker: predict, choose, fit coarse to fine; search widely when the body was missed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.scoring.foreground import body_like
from airborne.tracking import predictors
from airborne.tracking.appearance import Appearance, Region
from airborne.tracking.estimate import Estimate, Status, lost
from airborne.tracking.gauss_newton import CLOSE, FAR, NEAR, Fit, Levels, Synthesis, fit_pictures, fit_silhouettes
from airborne.tracking.loss import Agreement, Usual, agreement, status_of
from airborne.tracking.regions import regions_round
from airborne.tracking.wide import Reach, search_widely
from airborne.video import Frames

Array = NDArray[np.floating]

_MARGIN_PX, _FIRST_MARGIN_PX = 32, 56  # of a full frame
_REMEMBERED = 3
_FITTED_AFTER_SEARCH = 3

PREDICTIONS: dict[str, tuple[Callable[[predictors.Past, Fraction], Pose], ...]] = {
    "smooth": (predictors.quadratic, predictors.linear),
    "ballistic": (predictors.ballistic, predictors.quadratic),
    "none": (predictors.stay,),
}


@dataclass(frozen=True, slots=True)
class RefinedState:
    """What the next frame needs."""

    past: tuple[tuple[Fraction, Pose], ...] = ()  # the last poses found, oldest first
    appearance: Appearance = field(default_factory=Appearance)
    usual: Usual = field(default_factory=Usual)


class Refined:
    """Track by Gauss-Newton on all cameras' pictures; see `gauss_newton`."""

    def __init__(self, model: BodyModel, start: Pose, *, prediction: str = "smooth") -> None:
        self._synthesis = Synthesis.of(model)
        self._start = start
        self._predict = PREDICTIONS[prediction]

    def init(self) -> RefinedState:
        """Return the state before the first frame."""
        return RefinedState()

    def search(self, state: RefinedState, frames: Frames) -> Estimate:
        """Find the body in the frames, without learning from them."""
        past = state.past
        poses = [predict(past, frames.time_s) for predict in self._predict] if past else [self._start]
        guesses = [self._synthesis.model.with_pose(pose) for pose in poses]
        fit, agreed = self._fit(guesses, frames, state, is_first=not past)
        if past and (agreed is None or agreed.is_suspect(state.usual)):
            reach = Reach.after(float(frames.time_s - past[-1][0]))
            wide = search_widely(self._synthesis, guesses, frames, state.appearance, reach)
            again, agreed_again = self._fit(wide, frames, state, n_fitted=_FITTED_AFTER_SEARCH)
            if agreed_again is not None and (agreed is None or agreed_again.evidence > agreed.evidence):
                fit, agreed = again, agreed_again
        return _estimate(frames, fit, agreed, state.usual)

    def learn(self, state: RefinedState, frames: Frames, estimate: Estimate) -> RefinedState:
        """Return the state after the frames, given where the body was found."""
        if estimate.pose is None:
            return state
        past = (*state.past, (frames.time_s, estimate.pose))[-_REMEMBERED:]
        if estimate.status is not Status.TRACKED and state.past:
            return replace(state, past=past)
        body, appearance = self._synthesis.model.with_pose(estimate.pose), state.appearance
        regions = regions_round([body], self._synthesis.geometry, frames, _MARGIN_PX)
        for region in regions:
            mask = self._synthesis.parts(body, region) >= 0
            appearance.learn_colours(region, mask)
            appearance.learn_scene(region, mask)
        known = [region for region in regions if appearance.knows(region)]
        agreed = agreement(self._synthesis, body, known, [appearance.posterior(region) for region in known])
        return RefinedState(past, appearance, state.usual.learned(agreed) if known else state.usual)

    def _fit(
        self,
        guesses: Sequence[PosedBody],
        frames: Frames,
        state: RefinedState,
        *,
        is_first: bool = False,
        n_fitted: int = 1,
    ) -> tuple[Fit | None, Agreement | None]:
        """Fit from the guesses that the pictures like best, and keep the best fit; (None, None) where no view sees any.

        With `n_fitted` above 1, every guess is first fitted to the silhouettes.
        """
        margin_px = _FIRST_MARGIN_PX if is_first else _MARGIN_PX
        regions = regions_round(guesses, self._synthesis.geometry, frames, margin_px)
        appearance = state.appearance
        if is_first and regions:
            appearance = self._first_look(guesses[0], regions)
        regions = [region for region in regions if appearance.knows(region)]
        if not regions:
            return None, None
        posteriors = [appearance.posterior(region) for region in regions]

        def agreed(body: PosedBody) -> Agreement:
            return agreement(self._synthesis, body, regions, posteriors)

        def to_silhouettes(body: PosedBody, levels: Levels) -> PosedBody:
            return fit_silhouettes(self._synthesis, body, regions, posteriors, levels)

        def to_pictures(body: PosedBody) -> Fit:
            return fit_pictures(self._synthesis, body, regions, self._with_scenes(appearance, body, regions))

        if n_fitted > 1:
            bodies = [to_silhouettes(guess, NEAR) for guess in guesses]
            bodies = sorted(bodies, key=lambda body: agreed(body).evidence, reverse=True)[:n_fitted]
            fit = max(map(to_pictures, bodies), key=lambda each: agreed(each.posed).evidence)
        elif is_first:
            fit = to_pictures(to_silhouettes(guesses[0], FAR))
        else:
            best = max(((guess, agreed(guess)) for guess in guesses), key=lambda each: each[1].evidence)
            fit = to_pictures(to_silhouettes(best[0], NEAR if best[1].is_suspect(state.usual) else CLOSE))
        return fit, agreed(fit.posed)

    def _first_look(self, posed: PosedBody, regions: Sequence[Region]) -> Appearance:
        """Learn the colours from a pose set by hand, mend the pose by them, and learn them again.

        The first time, pixels of the mask that are more like the background than like the body's own colours are left
        out: the pose may be off by more than the body is wide.
        """
        for look in range(3):
            appearance = Appearance()
            for region in regions:
                part = self._synthesis.parts(posed, region)
                body = body_like(region.rgb, part, self._synthesis.geometry.colours) if look == 0 else None
                appearance.learn_colours(region, part >= 0, body=body)
            known = [region for region in regions if appearance.knows(region)]
            posteriors = [appearance.posterior(region) for region in known]
            posed = fit_silhouettes(self._synthesis, posed, known, posteriors, FAR)
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


def _estimate(frames: Frames, fit: Fit | None, agreed: Agreement | None, usual: Usual) -> Estimate:
    if fit is None or agreed is None or (status := status_of(fit, agreed, usual)) is Status.LOST:
        return lost(frames.index, frames.time_s)
    return Estimate(
        index=frames.index,
        time_s=frames.time_s,
        status=status,
        score=fit.rms_light * 255,
        pose=Pose(world_from_root=fit.posed.world_from_root),
        covariance=fit.covariance,
        n_views=agreed.n_views,
    )
