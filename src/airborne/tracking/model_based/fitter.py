"""Which degrees of freedom are fitted at which level: by silhouettes from coarse to fine, then by the images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.tracking.model_based import turned_pelvis
from airborne.tracking.model_based.degrees_of_freedom import (
    DegreesOfFreedom,
    PosePrior,
    joints_of,
    limbs_of,
    pair_of_segment,
    proximal_to_distal,
    root_only,
)
from airborne.tracking.model_based.gauss_newton import (
    FAR,
    NEAR,
    Fit,
    PyramidLevels,
    fit_images,
    fit_silhouettes,
    linearise_fit,
    weigh_images,
)
from airborne.tracking.model_based.image_views import ImageView
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.left_right_swap import swap_limbs
from airborne.tracking.model_based.mask_faults import MaskFaults, find_mask_faults
from airborne.tracking.model_based.misplaced_limbs import (
    SAME_M,
    is_same_place,
    limb_distance,
    search_limb,
    with_limb,
)
from airborne.tracking.model_based.place_costs import best_place, improbable_nats
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.status import MaskAgreement, mask_agreement
from airborne.tracking.model_based.support import count_views
from airborne.types import Array

Order = Literal["refined", "joint", "hierarchical"]

# of evidence that a mask gains at least where a new fit of the whole body is better: of 153 such fits, of three
# synthetic people and two recorded ones, the 29 that were taken had gained 5.3 or more
_RISEN_NATS = 4.0
_TRUNK_AT = 4  # images at this reduction show the limbs of a body with joints; more reduced ones, its trunk alone


@dataclass(frozen=True, slots=True, eq=False)
class JudgedFit:
    """Where a fit ended, and how well its mask agrees with the images."""

    fit: Fit
    agreement: MaskAgreement


@dataclass(frozen=True, slots=True, eq=False)
class Fitter:
    """A body, and the stages in which its degrees of freedom are set free: the trunk first, at last everything."""

    render_model: RenderModel
    stages: Sequence[DegreesOfFreedom]
    order: Order

    @classmethod
    def of(cls, render_model: RenderModel, order: Order, *, fixed_shape: bool) -> Fitter:
        """Let everything move, or with a fixed shape the root alone."""
        model = render_model.model
        return cls(render_model, [root_only(model)] if fixed_shape else proximal_to_distal(model), order)

    @property
    def model(self) -> BodyModel:
        """The body."""
        return self.render_model.model

    @property
    def moves_joints(self) -> bool:
        """Whether more than the root is fitted."""
        return self.stages[-1].moves_joints

    def swap_limbs(self, pose: Pose) -> list[Pose]:
        """Return the poses with a pair of limbs swapped; none where no joint moves."""
        return swap_limbs(self.model, pose) if self.moves_joints else []

    def agreement(self, pose: Pose, learned: LearnedRegions) -> MaskAgreement:
        """Compare a pose's mask with the images."""
        return mask_agreement(self.render_model, self.render_model.with_pose(pose), *learned.views)

    def fit_silhouettes(
        self, pose: Pose, learned: LearnedRegions, levels: PyramidLevels, prior: PosePrior | None
    ) -> Pose:
        """Fit the masks level by level: on the coarser ones, the trunk first."""
        for level in levels:
            for dofs in self._stages_at(level[0]):
                args = self.render_model, pose, learned.masks
                pose = fit_silhouettes(*args, levels=[level], dofs=dofs, prior=prior, goes_on=levels is FAR)
        return pose

    def fit_images(self, poses: Sequence[Pose], learned: LearnedRegions, prior: PosePrior | None) -> Fit:
        """Fit the images from several poses; return the best fit."""
        views = self._views(poses, learned)
        *before, last = self.stages if self.order == "hierarchical" else self.stages[-1:]
        for dofs in before:
            poses = [fit_images(self.render_model, poses, views, dofs=dofs, prior=prior).pose]
        return fit_images(self.render_model, poses, views, dofs=last, prior=prior)

    def weigh(self, poses: Sequence[Pose], learned: LearnedRegions) -> Array:
        """Return minus the log-likelihood of the images in each pose, by the noise of the best one: (n,) [nat]."""
        return weigh_images(self.render_model, poses, self._views(poses, learned))

    def judge(
        self,
        fit: Fit,
        guesses: Sequence[Pose],
        learned: LearnedRegions,
        prior: PosePrior | None,
        *,
        searched: Pose | None = None,
    ) -> JudgedFit:
        """Refit the limbs that the fit has misplaced, from the guesses and from a search; judge what comes of it.

        Where the fit ends in a pose in which limbs were `searched` for already, they are not searched for again.
        """
        if not self.moves_joints:
            return JudgedFit(fit, self.agreement(fit.pose, learned))
        faults = self._refit_limbs(fit, guesses, learned, prior, searched)
        return self._assess(faults, faults.limbs.suspect, learned)

    def judge_pose(self, pose: Pose, learned: LearnedRegions) -> JudgedFit:
        """Judge a pose with joints that frames before and after confirm: only limbs that are surely misplaced are."""
        fit = linearise_fit(self.render_model, pose, self._views([pose], learned), dofs=self.stages[-1])
        faults = find_mask_faults(self.render_model, fit, learned)
        return self._assess(faults, faults.limbs.misplaced, learned)

    def _assess(self, faults: MaskFaults, misplaced: Sequence[NDArray[np.int64]], learned: LearnedRegions) -> JudgedFit:
        fit, segments = faults.fit, tuple(int(segment) for limb in misplaced for segment in limb)
        n_views_of = count_views(self.render_model, fit.pose, fit.views, fit.equations.noise_of_views)
        for limb in faults.beside:  # it may be there: no better than one view
            n_views_of[limb] = np.minimum(n_views_of[limb], 1)
        return JudgedFit(fit, replace(self.agreement(fit.pose, learned), misplaced=segments, n_views_of=n_views_of))

    def _views(self, poses: Sequence[Pose], learned: LearnedRegions) -> list[ImageView]:
        bodies = [self.render_model.with_pose(pose) for pose in poses]
        return learned.make_image_views(self.render_model, bodies, are_narrow=not self.moves_joints)

    def _refit_limbs(
        self,
        fit: Fit,
        guesses: Sequence[Pose],
        learned: LearnedRegions,
        prior: PosePrior | None,
        searched: Pose | None,
    ) -> MaskFaults:
        """Search for the limbs that cover what is unlike the body, or beside which, or anywhere, what is stands out.

        None is searched for again before another has moved. Before the first, the whole body is fitted again.
        """
        limbs, tried = limbs_of(self.model), set[int]()
        if searched is not None:
            tried = {int(limb[0]) for limb in limbs if is_same_place(self.model, fit.pose, searched, limb)}
        is_tried = searched is not None and is_same_place(self.model, fit.pose, searched)

        def search(
            limb: NDArray[np.int64], faults: MaskFaults, prior: PosePrior | None
        ) -> tuple[MaskFaults, PosePrior | None]:
            if int(limb[0]) in tried:
                return faults, prior
            moved, prior = self._refit_limb(faults.fit, limb, guesses, learned, prior=prior)
            if moved is not faults.fit:
                tried.clear()
                faults = find_mask_faults(self.render_model, moved, learned)
            tried.add(int(limb[0]))
            return faults, prior

        faults = find_mask_faults(self.render_model, fit, learned)
        if faults.limbs.suspect or faults.beside or turned_pelvis.is_improbable(self.model, fit.pose):
            refitted, prior = (fit, prior) if is_tried else self._refit_body(fit, learned, prior)
            faults = faults if refitted is fit else find_mask_faults(self.render_model, refitted, learned)
            for limb in faults.limbs.suspect:
                faults, prior = search(limb, faults, prior)
            for limb in faults.beside:
                faults, prior = search(limb, faults, prior)
        for limb in limbs:
            if not faults.asks_for_limb:
                break
            faults, prior = search(limb, faults, prior)
        return faults

    def _refit_body(self, fit: Fit, learned: LearnedRegions, prior: PosePrior | None) -> tuple[Fit, PosePrior | None]:
        """Fit everything again, freer of what was expected, and an improbable pose from where it may have come from."""
        if prior is None:
            return fit, prior
        loose = prior.loosen()
        starts = [fit.pose, *turned_pelvis.find_turned_pelvis(self.render_model, fit.pose, learned.evidence)]
        fit, prior = self._refit_from(starts, fit, learned, prior=prior, widened=loose)
        if not turned_pelvis.is_improbable(self.model, fit.pose):
            return fit, prior
        back = turned_pelvis.turn_pelvis_back(self.model, fit.pose)
        free = loose.widen(turned_pelvis.pelvis_columns(self.model))
        return self._refit_from(back, fit, learned, prior=prior, widened=free, n_lost=2)

    def _refit_from(
        self,
        starts: Sequence[Pose],
        fit: Fit,
        learned: LearnedRegions,
        *,
        prior: PosePrior | None,
        widened: PosePrior,
        n_lost: int = 1,
    ) -> tuple[Fit, PosePrior | None]:
        """Fit masks from several starts, and the images from those that rise; return the best fit."""
        poses = [self.fit_silhouettes(start, learned, NEAR, widened) for start in starts]

        def mask_nats(pose: Pose) -> float:
            return self.agreement(pose, learned).evidence / fit.equations.shared - improbable_nats(self.model, pose)

        least = mask_nats(fit.pose) + _RISEN_NATS
        fits = [self.fit_images([pose], learned, widened) for pose in poses if mask_nats(pose) > least]
        return best_place(self.render_model, [fit, *fits], learned, prior=prior, widened=widened, n_lost=n_lost)

    def _refit_limb(
        self,
        fit: Fit,
        limb: NDArray[np.int64],
        guesses: Sequence[Pose],
        learned: LearnedRegions,
        *,
        prior: PosePrior | None,
    ) -> tuple[Fit, PosePrior | None]:
        """Search for a limb, from where the fit and the guesses have it and from anywhere; return the better fit.

        The place of most evidence is fitted to the images, if that is another: of 280 searches in ten synthetic
        somersaults no second place was better. The prior is returned too, wide for a limb that was moved.
        """
        expected = [replace(fit.pose, joint_angles=with_limb(fit.pose, guess, limb)) for guess in guesses]
        maps = learned.limb_evidence(int(pair_of_segment(self.model)[limb[0]]))
        places = search_limb(self.render_model, [fit.pose, *expected], limb, maps, shared=fit.equations.shared)
        dofs, masks, coarse = joints_of(self.model, limb), learned.masks, len(NEAR) - 1
        poses = [fit_silhouettes(self.render_model, pose, masks, levels=NEAR[:coarse], dofs=dofs) for pose in places]
        best = max(poses, key=lambda pose: self.agreement(pose, learned).evidence)
        best = fit_silhouettes(self.render_model, best, masks, levels=NEAR[coarse:], dofs=dofs)
        if limb_distance(self.model, fit.pose, best, limb) < SAME_M:
            return fit, prior
        widened = None if prior is None else prior.widen(dofs.columns)
        moved = self.fit_images([best], learned, widened)
        return best_place(self.render_model, [fit, moved], learned, prior=prior, widened=widened)

    def _stages_at(self, reduction: int) -> list[DegreesOfFreedom]:
        trunk, everything = self.stages[0], self.stages[-1]
        if self.order == "joint" or not self.moves_joints:
            return [everything]
        return [trunk] * (reduction >= _TRUNK_AT) + [everything] * (reduction <= _TRUNK_AT)
