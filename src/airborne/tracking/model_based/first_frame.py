"""The first frame: from a pose set by hand, with nothing learned, to a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from airborne.appearance.foreground import body_like
from airborne.appearance.model import Appearance, Region
from airborne.body import Pose
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import PosePrior
from airborne.tracking.model_based.fitter import Fitter, JudgedFit
from airborne.tracking.model_based.gauss_newton import FAR
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.lens_blur import learn_blurs
from airborne.video import Frames

_MARGIN_PX = 56  # of a full frame
_ROUNDS = 3  # of learning the colours and correcting the pose


def fit_first(fitter: Fitter, start: Pose, frames: Frames, prior: PosePrior | None) -> JudgedFit | None:
    """Fit from a pose set by hand, and from the same with limbs swapped; None where no view shows it."""
    render_model = fitter.render_model
    regions = crop_regions([render_model.with_pose(start)], render_model.geometry, frames, _MARGIN_PX)
    learned = LearnedRegions.of(regions, _learn_first_colours(fitter, start, regions, prior))
    if not learned.masks.regions:
        return None
    poses = [fitter.fit_silhouettes(pose, learned, FAR, prior) for pose in (start, *fitter.swap_limbs(start))]
    beside = fitter.swap_limbs(poses[0]) if fitter.moves_joints else [start]  # which tells sides, and colours, apart
    fit = fitter.fit_images([*poses, *beside], learned, prior)
    if not fitter.moves_joints:
        regions, known = learned.masks.regions, learned.appearance
        learned = replace(learned, appearance=learn_blurs(render_model, fit.pose, regions, known))
        fit = fitter.fit_images([fit.pose], learned, prior)
    return fitter.judge(fit, [start], learned, prior)


def _learn_first_colours(fitter: Fitter, pose: Pose, regions: Sequence[Region], prior: PosePrior | None) -> Appearance:
    """Learn the colours from a pose set by hand, correct the pose by them, and learn them again.

    The first time, pixels of the mask that are more like the background than like the body's own colours are left
    out: the pose may be wrong by more than the body's width.
    """
    render_model, appearance = fitter.render_model, Appearance()
    for number in range(_ROUNDS):
        if number:
            pose = fitter.fit_silhouettes(pose, LearnedRegions.of(regions, appearance), FAR, prior)
        posed, appearance = render_model.with_pose(pose), Appearance()
        for region in regions:
            part = render_model.draw_parts(posed, region)
            body = body_like(region.rgb, part, render_model.geometry.colours) if number == 0 else None
            appearance = appearance.learn_colours(region, part >= 0, body=body)
    return appearance
