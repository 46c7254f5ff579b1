"""Motion blur: an image is the mean of what is seen while it is exposed; the fit is to the middle of that time.

What the exposure changes, the mean of composites along the body's motion less the composite of its middle, is taken
off the image. The rest shows the middle, as sharp as if the body had stood. The change depends on the pose: it is found
anew after each fit. Only for things: people's shape errors outweigh it, and synthetic somersaults exposed for 8 ms were
tracked no better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from airborne.body import Pose, PosedBody
from airborne.body.chain import delta_between, move_pose
from airborne.tracking.image_regions import bounding_points
from airborne.tracking.model_based.gauss_newton import Fit, fit_images
from airborne.tracking.model_based.image_views import ImageView
from airborne.tracking.model_based.normal_equations import light_by_lamps, light_fitted
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers
from airborne.types import Array

Extrapolation = Callable[[Pose, float], Pose]  # a pose -> that so many seconds later

_ROUNDS, _OVERSTEP = 3, 2.0  # on throws exposed for 8 and 16 ms, five rounds gain little more; alone each goes a third
_LEAST_PX = 1.0  # of motion in an exposure that is worth it
_STEP_PX, _MOST_POSES = 2.0, 8  # between poses along the motion: no more than the comparison's blur hides


class Exposure(NamedTuple):
    """For how long a view is exposed, and where its camera is."""

    s: float
    packed_view: Array  # (18,) of `pack_view`
    K: Array  # (3, 3) [px]


def fit_exposed(render_model: RenderModel, fit: Fit, motion: Extrapolation) -> Fit:
    """Fit again to what the images would show if the body had stood while they were exposed."""
    seen, pose = fit.views, fit.pose
    for _ in range(_ROUNDS):
        views = still_images(render_model, seen, pose, motion)
        if views is None:
            return fit
        fit = fit_images(render_model, [pose], views, dofs=fit.dofs, prior=fit.prior)
        pose = move_pose(pose, _OVERSTEP * delta_between(pose, fit.pose))
    return replace(fit, pose=pose)


def still_images(
    render_model: RenderModel, images: Sequence[ImageView], pose: Pose, motion: Extrapolation
) -> list[ImageView] | None:
    """Return the images as they would be if the body had stood at a pose; None where it hardly moves in any."""
    middle, stilled, is_any = render_model.with_pose(pose), [], False
    for image in images:
        exposure = Exposure(image.exposure_s, image.buffers.packed_view, image.buffers.K)
        bodies = bodies_in_exposure(render_model, pose, motion, exposure)
        if len(bodies) > 1:
            is_any, image = True, _still_image(render_model, image, middle, bodies)
        stilled.append(image)
    return stilled if is_any else None


def bodies_in_exposure(
    render_model: RenderModel, pose: Pose, motion: Extrapolation, exposure: Exposure
) -> list[PosedBody]:
    """Return the body evenly along its motion while a view is exposed; that of the middle where it hardly moves."""
    exposure_s, packed_view, K = exposure
    if exposure_s:
        points = []
        for s in (-exposure_s / 2, exposure_s / 2):
            body = render_model.with_pose(motion(pose, s))
            at = bounding_points(body, render_model.geometry) @ packed_view[:9].reshape(3, 3).T + packed_view[9:12]
            points.append(at[:, :2] / np.maximum(at[:, 2:], 1e-6) * K[[0, 1], [0, 1]])
        length_px = float(np.linalg.norm(points[1] - points[0], axis=1).max())
        if length_px > _LEAST_PX:
            n = min(_MOST_POSES, max(2, int(np.ceil(length_px / _STEP_PX))))
            moments_s = exposure_s * ((np.arange(n) + 0.5) / n - 0.5)
            return [render_model.with_pose(motion(pose, float(s))) for s in moments_s]
    return [render_model.with_pose(pose)]


def _still_image(
    render_model: RenderModel, image: ImageView, middle: PosedBody, bodies: Sequence[PosedBody]
) -> ImageView:
    view = image.buffers
    change = np.mean([_composite_change(render_model, body, view) for body in bodies], axis=0)
    change -= _composite_change(render_model, middle, view)
    observation = view.observation._replace(observed=view.observation.observed - change)
    return image._replace(buffers=view._replace(observation=observation).prepare(image.comparison))


def _composite_change(render_model: RenderModel, body: PosedBody, view: ViewBuffers) -> Array:
    """Return the composite less the background: (3, h, w), in the light that was fitted or is known."""
    args = render_model.body, view.projection(body)
    if render_model.lights is None:
        lit = light_fitted(*args, view.maps, render_model.paint, view.light)
    else:
        lit = light_by_lamps(*args, view.maps, *view.light)
    change, is_body = np.zeros_like(lit), view.maps.part >= 0
    change[:, is_body] = lit[:, is_body] - view.observation.background[:, is_body]
    return change
