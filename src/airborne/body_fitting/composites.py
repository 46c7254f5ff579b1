"""How a body's composite images change with its shape and its poses, by finite differences of rendered images.

The same composite as `gauss_newton.fit_images`, the lit body over the empty scene, blurred, with the same robust
cost; here the body is rendered twice per parameter for its derivative, so that any parameter will do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.lighting import fit_light, shade_body
from airborne.body import PosedBody
from airborne.rendering.maps import surface_maps
from airborne.tracking.model_based.blur import RADIUS_PX, blur_planes, gaussian_taps
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers
from airborne.tracking.model_based.twist_equations import BLOCK_PX
from airborne.types import Array

_SIGMA_PX = 1.2  # of the blur
_SCALE_LIGHT = 0.1  # linear light, 0..1, of the robust cost: a residual this large has a quarter of the weight
_CORRELATED_PX = BLOCK_PX**2  # pixels that share the error of an approximate shape
_LIGHT_ROUNDS = 3  # reweightings of the light
_NEAR_PX = 4  # beyond this from the mask, a small step changes nothing


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


PosedModel = tuple[RenderModel, PosedBody]


def composite_equations(
    render_model: RenderModel,
    posed: PosedBody,
    view: ViewBuffers,
    steps: Sequence[tuple[PosedModel, PosedModel | None, float]],
) -> tuple[Misfit, Array, Array]:
    """Return a view's misfit and the normal equations H (d, d), g (d,) of d parameters: H step = g.

    steps: for each parameter the body a step up; the body a step down, or None for the body as it is; and the
    difference of the parameter between the two.
    """
    _fit_light(render_model, posed, view)
    here = _compose(render_model, posed, view)
    residual = _residual(view, here)
    total, weights = _weigh(view, residual)
    near = cv2.dilate((view.maps.part >= 0).astype(np.uint8), np.ones((2 * _NEAR_PX + 1,) * 2, np.uint8)) > 0
    rows, across = _box(near)
    columns = np.zeros((len(steps), 3, rows.stop - rows.start, across.stop - across.start), np.float32)
    for column, (above, below, step) in zip(columns, steps, strict=True):
        change = (_compose(*above, view) - (here if below is None else _compose(*below, view)))[:, rows, across]
        v, u = _box(np.abs(change).max(axis=0, initial=0) > 0, RADIUS_PX)
        if v.stop > v.start:
            blurred = np.empty_like(change[:, v, u])
            blur_planes(np.ascontiguousarray(change[:, v, u]), *_taps(view), blurred)
            column[:, v, u] = blurred / np.float32(step)
    weight = np.tile(weights[rows, across].ravel(), 3)
    flat = columns.reshape(len(steps), -1)
    weighted_columns = flat * weight
    return (
        total,
        (weighted_columns @ flat.T).astype(float),
        (weighted_columns @ residual[:, rows, across].ravel()).astype(float),
    )


def _fit_light(render_model: RenderModel, posed: PosedBody, view: ViewBuffers) -> None:
    part, _, normals = view.maps
    surface_maps(render_model.shapes, render_model.geometry, posed.R, posed.t, view.packed_view, *view.maps)
    height, width = part.shape
    fit_light(
        view.observation.observed, part, normals, render_model.albedo, view.light, _LIGHT_ROUNDS, 0, 0, width, height
    )


def _compose(render_model: RenderModel, posed: PosedBody, view: ViewBuffers) -> NDArray[np.float32]:
    """Composite the body over the scene under the view's light: (3, h, w) linear light."""
    part, _, normals = view.maps
    surface_maps(render_model.shapes, render_model.geometry, posed.R, posed.t, view.packed_view, *view.maps)
    lit = np.zeros((3, *part.shape), np.float32)
    shade_body(part, normals, render_model.albedo, view.light, 0, 0, lit)
    return np.where(part >= 0, lit, view.observation.background)


def _residual(view: ViewBuffers, composite: NDArray[np.float32]) -> NDArray[np.float32]:
    out = np.empty_like(composite)
    blur_planes(view.observation.observed - composite, *_taps(view), out)
    return out


def _weigh(view: ViewBuffers, residual: NDArray[np.float32]) -> tuple[Misfit, NDArray[np.float32]]:
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


def _box(mask: NDArray[np.bool_], margin: int = 0) -> tuple[slice, slice]:
    """Return the bounding rows and columns of a mask, with a margin; empty where the mask is."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return slice(0, 0), slice(0, 0)
    return (
        slice(max(int(rows[0]) - margin, 0), int(rows[-1]) + 1 + margin),
        slice(max(int(columns[0]) - margin, 0), int(columns[-1]) + 1 + margin),
    )
