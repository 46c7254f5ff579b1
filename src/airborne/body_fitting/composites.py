"""How a body's composite images change with its shape and its poses.

The same composite as `gauss_newton.fit_images`, the lit body over the empty scene, blurred, with the same robust
cost; here a segment's surface may also change its shape, so that its motion is affine.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.lighting import fit_light, flatten_shading, shade_body
from airborne.body import PosedBody
from airborne.body_fitting.affine_equations import add_affine_equations
from airborne.body_fitting.shape_motion import N_AFFINE
from airborne.rendering.maps import surface_maps
from airborne.tracking.model_based.blur import blur_planes, gaussian_taps
from airborne.tracking.model_based.owners import REACH_PX, find_owners
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers
from airborne.tracking.model_based.twist_equations import BLOCK_PX
from airborne.types import Array, Array32

_SIGMA_PX = 1.2  # of the blur
_SCALE_LIGHT = 0.1  # linear light, 0..1, of the robust cost: a residual this large has a quarter of the weight
_CORRELATED_PX = BLOCK_PX**2  # pixels that share the error of an approximate shape
_LIGHT_ROUNDS = 3  # reweightings of the light


@dataclass(frozen=True, slots=True)
class Misfit:
    """The difference between rendered and observed images, summed over pixels."""

    cost: float  # robust squared residual of the whole regions
    weight: float  # of the whole regions
    body_cost: float  # weighted squared residual where there is body
    body_weight: float  # weight where there is body

    def __add__(self, other: Misfit) -> Misfit:
        """Add two views."""
        return Misfit(
            self.cost + other.cost,
            self.weight + other.weight,
            self.body_cost + other.body_cost,
            self.body_weight + other.body_weight,
        )

    @property
    def noise(self) -> float:
        """Mean square of the weighted residual, times the number of correlated pixels."""
        return _CORRELATED_PX * max(self.body_cost / self.body_weight, 1e-9) if self.body_weight else 1.0

    @property
    def rms_light(self) -> float:
        """Root mean of the robust squared residual over the regions, linear light 0..1."""
        return (self.cost / self.weight) ** 0.5 if self.weight else float("nan")


NO_MISFIT = Misfit(0.0, 0.0, 0.0, 0.0)


def misfit(render_model: RenderModel, posed: PosedBody, view: ViewBuffers) -> Misfit:
    """Compare a body with a view; refits the view's light in place."""
    _fit_light(render_model, posed, view)
    return _weigh(view, _residual(view, _compose(render_model, posed, view)))[0]


def composite_equations(
    render_model: RenderModel, posed: PosedBody, view: ViewBuffers, border_axes: Array
) -> tuple[Misfit, Array, Array]:
    """Return a view's misfit and the normal equations of its segments' affine motions: A (s, 13, 13), g (s, 13).

    border_axes (s, 3): along which each segment's border of colours moves, world. Refits the view's light in place.
    """
    _fit_light(render_model, posed, view)
    part, inverse_depth, normals = view.maps
    covered = part >= 0
    lit = np.zeros((3, *part.shape), np.float32)
    shade_body(part, normals, render_model.albedo, view.light, 0, 0, lit)
    background = view.observation.background
    residual = _residual(view, np.where(covered, lit, background))
    total, weights = _weigh(view, residual)
    coverage, shape = np.empty((1, *part.shape), np.float32), np.empty_like(lit)
    blur_planes(covered[None].astype(np.float32), *_taps(view), coverage)
    flatten_shading(part, *render_model.paint, lit)
    blur_planes(lit, *_taps(view), shape)
    owner, nearness = np.empty(part.shape, np.int16), np.empty(part.shape, np.float32)
    find_owners(part, inverse_depth, render_model.segment_of_part, owner, nearness)
    n = len(posed.R)
    A, g = np.zeros((n, N_AFFINE, N_AFFINE)), np.zeros((n, N_AFFINE))
    add_affine_equations(
        *(residual, shape, coverage[0], weights, owner, nearness),
        *(_inner_borders(part, owner), border_axes, background, view.projection(posed), A, g),
    )
    return total, A + np.tril(A, -1).swapaxes(1, 2), g


def _inner_borders(part: NDArray[np.int16], owner: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Mark the pixels (h, w) near to which their segment changes colour, and no other segment or scene lies."""
    size = np.ones((2 * REACH_PX + 1,) * 2, np.uint8)
    parts, owners = part + 1, owner + 1
    changes = cv2.dilate(parts, size) != cv2.erode(parts, size)
    return changes & (cv2.dilate(owners, size) == cv2.erode(owners, size))


def _fit_light(render_model: RenderModel, posed: PosedBody, view: ViewBuffers) -> None:
    part, _, normals = view.maps
    surface_maps(render_model.shapes, render_model.geometry, posed.R, posed.t, view.packed_view, *view.maps)
    height, width = part.shape
    of_body = part, normals, render_model.albedo, render_model.cloth
    fit_light(view.observation.observed, *of_body, view.light, _LIGHT_ROUNDS, 0, 0, width, height)


def _compose(render_model: RenderModel, posed: PosedBody, view: ViewBuffers) -> Array32:
    """Composite the body over the scene under the view's light: (3, h, w) linear light."""
    part, _, normals = view.maps
    surface_maps(render_model.shapes, render_model.geometry, posed.R, posed.t, view.packed_view, *view.maps)
    lit = np.zeros((3, *part.shape), np.float32)
    shade_body(part, normals, render_model.albedo, view.light, 0, 0, lit)
    return np.where(part >= 0, lit, view.observation.background)


def _residual(view: ViewBuffers, composite: Array32) -> Array32:
    out = np.empty_like(composite)
    blur_planes(view.observation.observed - composite, *_taps(view), out)
    return out


def _weigh(view: ViewBuffers, residual: Array32) -> tuple[Misfit, Array32]:
    """Return the misfit and each pixel's weight (h, w), with the body already in the view's maps."""
    certainty, covered = view.observation.certainty, view.maps.part >= 0
    e2 = np.einsum("khw,khw->hw", residual, residual)
    attenuation = 1 / (1 + e2 / _SCALE_LIGHT**2)
    weights = certainty * attenuation**2
    total = Misfit(
        float(np.sum(certainty * e2 * attenuation)),
        float(np.sum(certainty)),
        float(np.sum((weights * e2)[covered])),
        float(np.sum(weights[covered])),
    )
    return total, weights


def _taps(view: ViewBuffers) -> tuple[Array, Array]:
    """Return the blur's taps along rows and columns; a field's rows are twice as far apart."""
    aspect = float(view.K[1, 1] / view.K[0, 0])
    return gaussian_taps(_SIGMA_PX), gaussian_taps(max(_SIGMA_PX * aspect, 0.5))
