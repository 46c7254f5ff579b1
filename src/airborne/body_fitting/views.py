"""Views of a person for a fit: the background, the body posed in every image, and the buffers of the comparison."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.appearance.model import Appearance
from airborne.body import BodyModel, Pose
from airborne.body.shaping import with_girths
from airborne.body_fitting.clothes import PosedView
from airborne.body_fitting.composites import NO_MISFIT, misfit
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers, image_buffers
from airborne.video import Frames

LEAST_MARGIN_PX = 8  # around the body


def learn_background(
    model: BodyModel, images: Sequence[Frames], poses: Sequence[Pose], *, girth: float, margin_px: float
) -> Appearance:
    """Learn the background from what a body of larger girth leaves uncovered."""
    render_model = RenderModel.of(_paint(with_girths(model, {s.name: girth for s in model.segments})))
    appearance = Appearance()
    for frames, pose in zip(images, poses, strict=True):
        posed = render_model.with_pose(pose)
        for region in crop_regions([posed], render_model.geometry, frames, margin_px):
            appearance = appearance.learn_background(region, render_model.draw_parts(posed, region) >= 0)
    return appearance


def _paint(model: BodyModel) -> BodyModel:
    """Colour the uncoloured parts grey."""
    grey = np.full(3, 128.0)
    return model.with_colours(np.array([grey if part.colour is None else part.colour for part in model.parts]))


def pose_views(model: BodyModel, poses: Sequence[Pose], images: Sequence[Frames]) -> list[PosedView]:
    """Pose the body in every image."""
    render_model, views = RenderModel.of(_paint(model)), []
    for pose, frames in zip(poses, images, strict=True):
        posed = render_model.with_pose(pose)
        regions = crop_regions([posed], render_model.geometry, frames, LEAST_MARGIN_PX)
        views += [(render_model, posed, region) for region in regions]
    return views


def prepare_views(
    model: BodyModel, poses: Sequence[Pose], images: Sequence[Frames], background: Appearance, *, margin_px: float
) -> tuple[tuple[ViewBuffers, ...], ...]:
    """Prepare the buffers of the images around a coloured body, by time."""
    render_model, buffers = RenderModel.of(model), []
    for pose, frames in zip(poses, images, strict=True):
        posed = render_model.with_pose(pose)
        regions = crop_regions([posed], render_model.geometry, frames, margin_px)
        buffers.append(tuple(image_buffers(render_model, region, background) for region in regions))
    return tuple(buffers)


def compare_fits(
    before: tuple[BodyModel, Sequence[Pose]],
    after: tuple[BodyModel, Sequence[Pose]],
    images: Sequence[Frames],
    background: Appearance,
) -> tuple[float, float]:
    """Return the residuals of two bodies over the same parts of the images."""
    totals = [NO_MISFIT, NO_MISFIT]
    models = [RenderModel.of(model) for model, _ in (before, after)]
    for i, frames in enumerate(images):
        bodies = [
            render_model.with_pose(each[1][i]) for render_model, each in zip(models, (before, after), strict=True)
        ]
        for region in crop_regions(bodies, models[1].geometry, frames, 0.0):
            for j, (render_model, posed) in enumerate(zip(models, bodies, strict=True)):
                totals[j] = totals[j] + misfit(render_model, posed, image_buffers(render_model, region, background))
    return totals[0].rms_light, totals[1].rms_light
