"""How many views show each segment of a limb: what the images would cost without it, and what follows for its joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import delta_between, move_pose
from airborne.tracking.model_based.absent_segments import absence_costs_in_fitted_light, absence_costs_in_known_light
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment
from airborne.tracking.model_based.image_views import ImageView
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array

_STRONG_NATS = 3.0  # a view shows a segment where it is 20 times likelier with it: "strong" (Kass & Raftery 1995)
_OBSERVED_SD_RAD, _UNOBSERVED_VARIANCE = 0.1, 1e6  # a rotation with a larger sd than this is hardly extrapolated
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
        rises = 0.5 * _absence_costs(render_model, posed, view, segments) / max(noise, 1e-9)
        counts[segments] += rises[segments] > _STRONG_NATS
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


def shrink_unobserved(last: Pose, predicted: Pose, covariance: Array) -> Pose:
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


def _absence_costs(
    render_model: RenderModel, posed: PosedBody, image: ImageView, segments: NDArray[np.integer]
) -> Array:
    """Return by how much the robust squared residual of an image rises as each of some segments is taken away: (s,).

    The light is that of the whole body as it was fitted, or is known.
    """
    view, rises, is_asked = image.buffers, np.zeros(len(posed.R)), np.zeros(len(posed.R), bool)
    is_asked[segments] = True
    args = render_model.body, view.projection(posed), view.observation, image.drawn
    if render_model.lights is None:
        absence_costs_in_fitted_light(*args, render_model.paint, view.light, is_asked, rises)
    else:
        absence_costs_in_known_light(*args, *view.light, is_asked, rises)
    return rises
