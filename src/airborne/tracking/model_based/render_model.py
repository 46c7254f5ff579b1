"""Render models (a body prepared for the kernels) and view buffers (regions of the views as the kernels take them)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import certainty_of, inpaint
from airborne.appearance.lighting import LIGHT_FROM_SRGB, LIGHT_TERMS, light_planes
from airborne.appearance.model import Appearance, Region
from airborne.body import BodyModel, Pose, PosedBody, SurfaceArrays, has_flat_sides, surface_arrays
from airborne.body.symmetry import continuous_axes
from airborne.cameras import Camera
from airborne.rendering import Lights
from airborne.rendering.maps import SurfaceMaps, empty_maps, surface_maps
from airborne.rendering.packing import pack_lights, pack_view, reduce_view
from airborne.rendering.shapes import new_shapes
from airborne.rendering.srgb import light_from_srgb
from airborne.tracking.covariance import SHIFT_SD_PX
from airborne.tracking.model_based.degrees_of_freedom import DegreesOfFreedom
from airborne.tracking.model_based.kernel_arguments import (
    Comparison,
    Observation,
    PackedBody,
    Paint,
    Projection,
    Window,
)
from airborne.tracking.model_based.normal_equations import prepare_rows
from airborne.types import Array, Array32

_TO_SHARE = (np.arange(1024) / 1023).astype(np.float32)  # sRGB as shares of full, for `light_planes`


@dataclass(frozen=True, slots=True, eq=False)
class RenderModel:
    """A body prepared for the kernels; its workspace serves one thread."""

    model: BodyModel
    geometry: SurfaceArrays
    shapes: Any
    segment_of_part: NDArray[np.int16]  # (parts,)
    albedo: Array32  # (parts, 3) linear light
    is_faceted: NDArray[np.bool_]  # (parts,) they have visible edges between flat sides
    cloth: NDArray[np.int16]  # (parts,) which parts are of one cloth
    symmetry_axes: dict[int, Array]  # segment -> (k, 3) in its frame: rotations about them change nothing
    lights: Lights | None  # None: unknown, fitted in each view

    @classmethod
    def of(cls, model: BodyModel, lights: Lights | None = None) -> RenderModel:
        """Prepare a body."""
        flat = surface_arrays(model)
        albedo = light_from_srgb(flat.colours).astype(np.float32)
        owners = [index for index, segment in enumerate(model.segments) for _ in segment.parts]
        is_faceted = np.array([has_flat_sides(part.shape) for part in model.parts])
        shapes, axes = new_shapes(flat), _symmetry_axes(model)
        cloth = np.arange(len(albedo), dtype=np.int16)
        return cls(model, flat, shapes, np.array(owners, np.int16), albedo, is_faceted, cloth, axes, lights)

    def copy(self) -> RenderModel:
        """Return the same body with a workspace of its own."""
        return replace(self, shapes=new_shapes(self.geometry))

    def reshape(self, model: BodyModel) -> RenderModel:
        """Prepare the same body in another shape: its colours stay, and its edges between flat sides."""
        flat = surface_arrays(model)
        return replace(self, model=model, geometry=flat, shapes=new_shapes(flat), symmetry_axes=_symmetry_axes(model))

    @property
    def body(self) -> PackedBody:
        """The body as the kernels take it."""
        return PackedBody(self.shapes, self.geometry, self.segment_of_part)

    @property
    def paint(self) -> Paint:
        """How the body reflects, as the kernels take it."""
        return Paint(self.albedo, self.is_faceted, self.cloth)

    def with_pose(self, pose: Pose) -> PosedBody:
        """Pose the body; the same as `BodyModel.with_pose`."""
        return _pose_body(self.model, pose)

    def jacobian(self, posed: PosedBody, dofs: DegreesOfFreedom) -> Array:
        """Return the segments' twists about the root's origin by each degree of freedom, less symmetries: (s, 6, d)."""
        J = dofs.jacobian(posed, posed.t[0])
        for segment, axes in self.symmetry_axes.items():
            unobservable = axes @ posed.R[0].T if segment == 0 else axes  # the root rotates about the world's axes
            columns = np.flatnonzero((dofs.columns >= 3 + 3 * segment) & (dofs.columns < 6 + 3 * segment))
            if len(columns):
                J[..., columns] = J[..., columns] @ (np.eye(3) - unobservable.T @ unobservable)
        return J

    def draw(self, posed: PosedBody, camera: Camera) -> SurfaceMaps:
        """Draw what each pixel of a camera's whole image shows."""
        maps = empty_maps(camera.size)
        surface_maps(self.shapes, self.geometry, posed.R, posed.t, pack_view(camera), *maps)
        return maps

    def draw_parts(self, posed: PosedBody, region: Region) -> NDArray[np.int16]:
        """Draw which part each pixel of a region shows: (h, w), -1 where none; not to be written to."""
        return _draw_parts(self, posed, region)


@lru_cache(maxsize=8)  # a fit is judged in one pose several times, and each time it is drawn in all views
def _pose_body(model: BodyModel, pose: Pose) -> PosedBody:
    root = pose.world_from_root.as_matrix()[None]
    joints = pose.joint_angles if pose.joint_angles.size else np.zeros((model.n_joints, 3))
    R, t = model.pose_segments(root[:, :3, :3], root[:, :3, 3], joints[None])
    return PosedBody(model, R[0], t[0])


@lru_cache(maxsize=8)
def _draw_parts(render_model: RenderModel, posed: PosedBody, region: Region) -> NDArray[np.int16]:
    maps = empty_maps(region.camera.size, with_normals=False)
    surface_maps(render_model.shapes, render_model.geometry, posed.R, posed.t, region.packed_view, *maps)
    return maps.part


def _symmetry_axes(model: BodyModel) -> dict[int, Array]:
    """Find the end segments that have an axis of symmetry through their joint."""
    symmetry_axes = {}
    for index in set(range(len(model.segments))) - set(model.parents.tolist()):
        segment = model.segments[index]
        if segment.parts:
            alone = BodyModel(segment.name, (replace(segment, parent=None),))
            symmetry_axes[index] = continuous_axes(alone)
    return {index: axes for index, axes in symmetry_axes.items() if len(axes)}


class ViewBuffers(NamedTuple):
    """A view as the kernels take it; see `kernel_arguments`."""

    packed_view: Array
    K: Array
    observation: Observation
    maps: SurfaceMaps  # workspace
    whole: Window  # the whole image
    light: Any = None  # (3, LIGHT_TERMS) to be fitted, or lamps (l, 8) and the ambient light

    @property
    def empty_cost(self) -> float:
        """What the image costs without a body, once it is prepared for a comparison."""
        return float(self.observation.rows[:, -1].sum())

    def prepare(self, comparison: Comparison) -> ViewBuffers:
        """Return the view prepared for a comparison."""
        seen = self.observation
        return self._replace(observation=prepare_rows(seen.observed, seen.background, seen.certainty, comparison))

    def projection(self, posed: PosedBody) -> Projection:
        """Project a body to this view; twists are about its root's origin."""
        return Projection(posed.R, posed.t, self.packed_view, self.K, posed.t[0])


def image_buffers(render_model: RenderModel, region: Region, appearance: Appearance) -> ViewBuffers:
    """Prepare a region: in linear light where the lights are unknown, in shares of full sRGB where they are known."""
    mean, sd, n_observations = appearance.background_pixels(region)
    certainty = np.empty(sd.shape, np.float32)
    background = mean
    if not certainty_of(sd, n_observations, certainty):
        background = np.empty_like(mean)
        if not inpaint(mean, n_observations, background):
            background[:] = region.rgb
    table = LIGHT_FROM_SRGB if render_model.lights is None else _TO_SHARE
    observed, background_light = np.empty((2, 3, *sd.shape), np.float32)
    light_planes(region.rgb, table, observed)
    light_planes(background, table, background_light)
    if render_model.lights is None:
        light: Any = np.zeros((3, LIGHT_TERMS), np.float32)
        light[:, 0] = 1
    else:
        light = pack_lights(render_model.lights, region.camera), np.float32(render_model.lights.ambient)
    maps = empty_maps(region.camera.size, with_normals=render_model.lights is None)
    whole = Window(0, 0, *region.camera.size)
    observation = Observation(observed, background_light, certainty)
    return ViewBuffers(region.packed_view, region.camera.K, observation, maps, whole, light)


def silhouette_buffers(region: Region, posterior: Array32, reduction: int, *, taps: Array, clip: float) -> ViewBuffers:
    """Prepare a region and its posterior, reduced, for a comparison of masks."""
    rows = _rows_of(region, reduction)
    plane = _reduce_plane(posterior, reduction, rows)
    K = region.camera.K.copy()
    K[:2, 2] -= (reduction - 1) / 2, (rows - 1) / 2
    K[0] /= reduction
    K[1] /= rows
    packed = reduce_view(region.packed_view, (reduction, rows))
    observation = Observation(plane[None], np.zeros((1, *plane.shape), np.float32), np.ones_like(plane))
    size = plane.shape[1], plane.shape[0]
    view = ViewBuffers(packed, K, observation, empty_maps(size, with_normals=False), Window(0, 0, *size))
    return view.prepare(Comparison(taps, taps, clip))


def reduce_region(region: Region, plane: Array32, reduction: int) -> tuple[Camera, Array32]:
    """Reduce a plane (h, w) of a region by averaging areas to about square pixels; return its camera and itself."""
    rows = _rows_of(region, reduction)
    small = _reduce_plane(plane, reduction, rows)
    middle, size = ((reduction - 1) / 2, (rows - 1) / 2), (small.shape[1], small.shape[0])
    return region.camera.resample(scale=(reduction, rows), offset=middle, size=size), small


def _rows_of(region: Region, reduction: int) -> int:
    return max(1, round(reduction * region.aspect))


def _reduce_plane(plane: Array32, reduction: int, rows: int) -> Array32:
    height, width = plane.shape
    size = (max(width // reduction, 1), max(height // rows, 1))
    small = cv2.resize(plane[: size[1] * rows, : size[0] * reduction], size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def shift_sds_px(region: Region) -> Array:
    """Return the sds of an image's shift right and down, in its own pixels, and of its outline's width: (3,) [px]."""
    shift_px = np.hypot(SHIFT_SD_PX, region.camera.shift_sd_px)
    return np.array([shift_px, shift_px * region.aspect, SHIFT_SD_PX])
