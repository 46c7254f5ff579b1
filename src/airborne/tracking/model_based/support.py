"""How many views show each segment of a limb: what the images would cost without it, and what follows for its joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.tracking.model_based.blur import RADIUS_PX
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment
from airborne.tracking.model_based.gauss_newton import ImageView
from airborne.tracking.model_based.kernel_arguments import Comparison, Paint, Window
from airborne.tracking.model_based.normal_equations import fill_costs, fill_costs_of_known_light
from airborne.tracking.model_based.owners import box_segments
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers
from airborne.types import Array

_BEHIND_M = 100.0  # a segment that is taken away goes this far behind the camera
_STRONG_NATS = 3.0  # a view shows a segment where it is 20 times likelier with it: "strong" (Kass & Raftery 1995)
_ONE_VIEW_SD_M = 0.1  # of the far end of a segment that one view alone shows


def count_views(
    render_model: RenderModel, pose: Pose, views: Sequence[ImageView], noise_of_views: Sequence[float]
) -> NDArray[np.int64]:
    """Count the views that show each segment: (segments,); those of the trunk are shown by all.

    views: as they were fitted, with the noise that was left of each. A view shows a segment if the image is clearly
    less likely without it: there the background is seen, or another segment behind, of perhaps the same colour.
    """
    posed, segments = render_model.with_pose(pose), np.flatnonzero(limb_of_segment(render_model.model) >= 0)
    counts = np.full(len(posed.R), len(views))
    counts[segments] = 0
    for view, noise in zip(views, noise_of_views, strict=True):
        packed = view.buffers.packed_view
        R, t = packed[:9].reshape(3, 3), packed[9:12]
        behind = -R.T @ t - _BEHIND_M * R[2]
        others = {int(segment): _without(posed, int(segment), behind) for segment in segments}
        counts[segments] += _rises_without(render_model, posed, others, view, noise=noise) > _STRONG_NATS
    return counts


def widen_unseen(covariance: Array, model: BodyModel, n_views: NDArray[np.integer]) -> Array:
    """Widen a pose's covariance for the joints of segments that fewer than two views show (segments,).

    One view alone leaves open how near the segment's end is; the joint of a segment that none shows is unobserved. A
    view that shows the next segment shows where this one ends. A segment without a landmark or a joint is left out.
    """
    covariance, of_end = covariance.copy(), n_views.copy()
    np.maximum.at(of_end, model.parents[1:], n_views[1:])
    for segment in np.flatnonzero((of_end < 2) & (limb_of_segment(model) >= 0)):
        own = slice(3 + 3 * segment, 6 + 3 * segment)
        length_m = _length_m(model, int(segment))
        if length_m == 0:
            continue
        if of_end[segment] == 1:
            covariance[own, own] += (_ONE_VIEW_SD_M / length_m) ** 2 * np.eye(3)
        else:
            covariance = mark_unobserved(covariance, np.arange(own.start, own.stop))
    return covariance


def mark_unobserved(covariance: Array, columns: NDArray[np.integer]) -> Array:
    """Return a covariance in which some degrees of freedom are unobserved: infinite."""
    covariance = covariance.copy()
    covariance[columns] = covariance[:, columns] = 0
    covariance[columns, columns] = np.inf
    return covariance


def _length_m(model: BodyModel, segment: int) -> float:
    """Return the distance from a segment's joint to the farthest landmark or joint fixed in it [m]."""
    name = model.segments[segment].name
    points = [child.joint_m for child in model.segments if child.parent == name]
    points += [landmark.position_m for landmark in model.landmarks if landmark.segment == name]
    return max((float(np.linalg.norm(point)) for point in points), default=0.0)


def _without(posed: PosedBody, segment: int, place: Array) -> PosedBody:
    t = posed.t.copy()
    t[segment] = place
    return replace(posed, t=t)


def _rises_without(
    render_model: RenderModel, posed: PosedBody, others: Mapping[int, PosedBody], image: ImageView, *, noise: float
) -> Array:
    """Return by how much minus the log-likelihood of one image rises as each of some segments is taken away: (k,).

    others: the same body without each segment. Light and noise are those of the whole body as it was fitted, and only
    the pixels around those that the segment covers are compared: no others change.
    """
    view, comparison, rises = image.buffers, image.comparison, np.zeros(len(others))
    costs = _pixel_costs(render_model, posed, view, comparison)
    boxes = np.zeros((len(render_model.model.segments), 4), np.int64)
    box_segments(view.maps.part, render_model.segment_of_part, boxes)
    for k, (segment, other) in enumerate(others.items()):
        if boxes[segment, 2] > 0:
            drawn, changed = (_widen(boxes[segment], view.whole, n_px) for n_px in (2 * RADIUS_PX, RADIUS_PX))
            without = _pixel_costs(render_model, other, view.crop(drawn), comparison)
            x0, y0, x1, y1 = changed
            part = without[y0 - drawn.y0 : y1 - drawn.y0, x0 - drawn.x0 : x1 - drawn.x0]
            rises[k] = 0.5 * float((part - costs[y0:y1, x0:x1]).sum()) / max(noise, 1e-9)
    return rises


def _pixel_costs(
    render_model: RenderModel, posed: PosedBody, view: ViewBuffers, comparison: Comparison
) -> NDArray[np.float32]:
    """Return the robust squared residual of each pixel of a view (h, w), in the light that was fitted or is known."""
    costs = np.empty(view.maps.part.shape, np.float32)
    args = render_model.body, view.projection(posed), view.observation, comparison
    if render_model.lights is None:
        fill_costs(*args, view.maps, Paint(render_model.albedo, render_model.is_faceted), view.light, costs)
    else:
        fill_costs_of_known_light(*args, view.maps, *view.light, costs)
    return costs


def _widen(box: NDArray[np.int64], whole: Window, rim: int) -> Window:
    """Return a box x0, y0, x1, y1 as a part of a window, with a rim [px]."""
    x0, y0, x1, y1 = box.tolist()
    return Window(max(x0 - rim, whole.x0), max(y0 - rim, whole.y0), min(x1 + rim, whole.x1), min(y1 + rim, whole.y1))
