"""Gauss-Newton by synthesis: the pose moves until its picture agrees with every camera's at once.

Far out, the blurred mask is fitted to the blurred probability of each pixel to be body, on reduced pictures
(`fit_silhouettes`). Close in, the composite of the lit body over the empty scene is fitted to the picture itself
(`fit_pictures`), which is not pulled toward bright edges as any classification is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Geometry, PosedBody, geometry, has_flat_sides
from airborne.body.symmetry import continuous_axes
from airborne.cameras import Camera
from airborne.rendering.maps import empty_maps, surface_maps
from airborne.rendering.packing import packed_view
from airborne.rendering.shapes import new_shapes
from airborne.rendering.srgb import light_from_srgb
from airborne.scoring.lighting import TERMS, TO_LIGHT, light_planes
from airborne.scoring.plate import START_SD, fill
from airborne.tracking.appearance import Appearance, Region
from airborne.tracking.covariance import SHIFT_SD_PX, covariance_of
from airborne.tracking.normal_equations import Sums, gaussian_taps, photometric_equations, silhouette_equations

Array = NDArray[np.floating]
Levels = Sequence[tuple[int, int]]

# reduction of the picture, iterations
FAR, NEAR, CLOSE = ((8, 5), (4, 4), (2, 3)), ((4, 2), (2, 2)), ((2, 2),)
_COARSE_SIGMA_PX = 1.2  # of the reduced picture
_FINE_SIGMA_PX = 1.2  # of a full frame
_CLIP = 0.1  # linear light, 0..1: a residual this large counts a quarter
_OVERSTEP = 1.6  # robust weights and refitted light make each step about this much too short
_MOST_STEPS = 12
_SETTLED = 2.0  # squared length of the last step, in sds of the pose
_PRIOR_SD = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])  # [m], [rad]: keeps what the pictures do not show where it is


@dataclass(frozen=True, slots=True)
class Synthesis:
    """A body made ready for the kernels; its workspace serves one thread."""

    model: BodyModel
    geometry: Geometry
    shapes: Any
    albedo: NDArray[np.float32]  # (parts, 3) linear light
    is_faceted: NDArray[np.bool_]  # (parts,) the edges between their sides can be seen
    free_axes: Array  # (k, 3) in the root's frame: turns about them change nothing

    @classmethod
    def of(cls, model: BodyModel) -> Synthesis:
        """Make a body ready."""
        flat = geometry(model)
        albedo = light_from_srgb(flat.colours).astype(np.float32)
        is_faceted = np.array([has_flat_sides(part.shape) for part in model.parts])
        return cls(model, flat, new_shapes(flat), albedo, is_faceted, continuous_axes(model))

    def visible(self, posed: PosedBody) -> Array:
        """Return the projection (6, 6) of motions, in world axes, onto those that change the picture at all."""
        hidden = np.concatenate([np.zeros_like(self.free_axes), self.free_axes @ posed.R[0].T], axis=1)
        return np.eye(6) - hidden.T @ hidden

    def parts(self, posed: PosedBody, region: Region) -> NDArray[np.int16]:
        """Draw which part each pixel of a region shows: (h, w), -1 where none."""
        maps = empty_maps(region.camera.size)
        surface_maps(self.shapes, self.geometry, posed.R, posed.t, region.packed, *maps)
        return maps[0]


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a fit ended."""

    posed: PosedBody
    covariance: Array  # (6, 6) position [m], world rotation vector [rad]; infinite where the pictures show nothing
    rms_light: float  # blurred residual, linear light 0..1
    steps: int


def fit_silhouettes(
    synthesis: Synthesis,
    posed: PosedBody,
    regions: Sequence[Region],
    posteriors: Sequence[Array],
    levels: Levels,
) -> PosedBody:
    """Move the body until its masks agree with the posteriors (h, w) of the regions, from coarse to fine."""
    taps = gaussian_taps(_COARSE_SIGMA_PX)
    correlated = 4 * np.pi * _COARSE_SIGMA_PX**2
    body = synthesis.shapes, synthesis.geometry
    for reduction, steps in levels:
        views = [_outlined(*each, reduction) for each in zip(regions, posteriors, strict=True)]
        for _ in range(steps):
            sums, totals = Sums.zero(), np.zeros(2)
            for view in views:
                totals += silhouette_equations(*body, posed.R, posed.t, *view, taps, taps, sums)
            motion = _solve(sums.curvature, sums.g, correlated * _mean_square(totals))
            posed = posed.moved(synthesis.visible(posed) @ motion)
    return posed


def fit_pictures(synthesis: Synthesis, posed: PosedBody, regions: Sequence[Region], appearance: Appearance) -> Fit:
    """Move the body until the composite of body and empty scene agrees with the pictures; say how sure that is."""
    views = [(_pictured(r, appearance), _even_light(), empty_maps(r.camera.size)) for r in regions]
    rows_sigma_px = [max(_FINE_SIGMA_PX * region.aspect, 0.5) for region in regions]
    taps = [(gaussian_taps(_FINE_SIGMA_PX), gaussian_taps(sigma)) for sigma in rows_sigma_px]
    correlated = 4 * np.pi * _FINE_SIGMA_PX * float(np.mean(rows_sigma_px))
    shifts_px = [_shifts_px(region) for region in regions]
    body, paint = (synthesis.shapes, synthesis.geometry), (synthesis.albedo, synthesis.is_faceted)
    for step in range(1, _MOST_STEPS + 1):
        sums, totals, spread = Sums.zero(), np.zeros(2), np.zeros((6, 6))
        rounds = 3 if step == 1 else 1
        for (view, light, maps), (taps_u, taps_v), shift_sd_px in zip(views, taps, shifts_px, strict=True):
            sums.B[:] = 0
            totals += photometric_equations(
                *body, posed.R, posed.t, *view, *paint, light, rounds, maps, taps_u, taps_v, _CLIP, sums
            )
            spread += (sums.B * shift_sd_px**2) @ sums.B.T
        visible, noise = synthesis.visible(posed), correlated * _mean_square(totals)
        A = visible @ sums.curvature @ visible
        motion = visible @ _solve(A, sums.g, noise)
        posed = posed.moved(_OVERSTEP * motion)
        if motion @ A @ motion <= _SETTLED * noise:
            break
    spread = visible @ (sums.S + spread) @ visible
    return Fit(posed, covariance_of(A, noise=noise, spread=spread), _mean_square(totals) ** 0.5, step)


class _Pictured(NamedTuple):
    """A region as `photometric_equations` takes it."""

    packed: Array
    K: Array
    observed: NDArray[np.float32]
    scene: NDArray[np.float32]
    certainty: NDArray[np.float32]


class _Outlined(NamedTuple):
    """A reduced region as `silhouette_equations` takes it."""

    packed: Array
    K: Array
    posterior: NDArray[np.float32]
    black: NDArray[np.float32]
    certainty: NDArray[np.float32]
    maps: Any


def _pictured(region: Region, appearance: Appearance) -> _Pictured:
    mean, sd, looks = appearance.scene(region)
    filled = np.empty_like(mean)
    if not fill(mean, looks, filled):
        filled[:] = region.rgb
    observed, scene = np.empty((2, 3, *sd.shape), np.float32)
    light_planes(region.rgb, TO_LIGHT, observed)
    light_planes(filled, TO_LIGHT, scene)
    certainty = np.minimum(1, (START_SD / sd) ** 2)
    return _Pictured(region.packed, region.camera.K, observed, scene, certainty)


def _shifts_px(region: Region) -> Array:
    """Return the sds of a picture's shift right and down, in its own pixels, and of its outline's width: (3,) [px]."""
    shift_px = np.hypot(SHIFT_SD_PX, region.camera.shift_sd_px)
    return np.array([shift_px, shift_px * region.aspect, SHIFT_SD_PX])


def _even_light() -> NDArray[np.float32]:
    light = np.zeros((3, TERMS), np.float32)
    light[:, 0] = 1
    return light


def reduced_region(region: Region, plane: Array, reduction: int) -> tuple[Camera, NDArray[np.float32]]:
    """Reduce a plane (h, w) of a region by averaging areas to about square pixels; return its camera and itself."""
    rows = max(1, round(reduction * region.aspect))
    height, width = plane.shape
    size = (max(width // reduction, 1), max(height // rows, 1))
    small = cv2.resize(plane[: size[1] * rows, : size[0] * reduction], size, interpolation=cv2.INTER_AREA)
    middle = ((reduction - 1) / 2, (rows - 1) / 2)
    return region.camera.resampled(scale=(reduction, rows), offset=middle, size=size), np.asarray(small, np.float32)


def _outlined(region: Region, posterior: Array, reduction: int) -> _Outlined:
    camera, plane = reduced_region(region, posterior, reduction)
    black, certainty = np.zeros((1, *plane.shape), np.float32), np.ones_like(plane)
    return _Outlined(packed_view(camera), camera.K, plane, black, certainty, empty_maps(camera.size))


def _mean_square(totals: Array) -> float:
    return totals[0] / totals[1] if totals[1] > 0 else 1.0


def _solve(A: Array, g: Array, noise: float) -> Array:
    """Solve for the motion (6,), held back where the pictures say little (Tikhonov)."""
    return np.linalg.solve(A + np.diag(max(noise, 1e-9) / _PRIOR_SD**2), g)
