"""A body made ready for the kernels, and the regions of the views as the kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.background import START_SD, fill
from airborne.appearance.lighting import TERMS, TO_LIGHT, light_planes
from airborne.appearance.model import Appearance, Region
from airborne.body import BodyModel, Geometry, Pose, PosedBody, geometry, has_flat_sides
from airborne.body.symmetry import continuous_axes
from airborne.cameras import Camera
from airborne.rendering import Lights, place_segments
from airborne.rendering.maps import empty_maps, surface_maps
from airborne.rendering.packing import packed_lights, packed_view
from airborne.rendering.shapes import new_shapes
from airborne.rendering.srgb import light_from_srgb
from airborne.tracking.covariance import SHIFT_SD_PX
from airborne.tracking.model_based.degrees_of_freedom import Freedom
from airborne.tracking.model_based.normal_equations import window_of

Array = NDArray[np.floating]
Window = tuple[int, int, int, int]  # x0, y0, x1, y1 in a region [px]

_ROOM_PX = 12  # that a body may move within a window, beyond the blur's reach
_TO_SHARE = (np.arange(1024) / 1023).astype(np.float32)  # sRGB as shares of full, for `light_planes`


@dataclass(frozen=True, slots=True)
class Synthesis:
    """A body made ready for the kernels; its workspace serves one thread."""

    model: BodyModel
    geometry: Geometry
    shapes: Any
    segment_of_part: NDArray[np.int16]  # (parts,)
    albedo: NDArray[np.float32]  # (parts, 3) linear light
    is_faceted: NDArray[np.bool_]  # (parts,) the edges between their sides can be seen
    free_axes: dict[int, Array]  # segment -> (k, 3) in its frame: its turns about them change nothing
    lights: Lights | None  # None: unknown, fitted in each view

    @classmethod
    def of(cls, model: BodyModel, lights: Lights | None = None) -> Synthesis:
        """Make a body ready."""
        flat = geometry(model)
        albedo = light_from_srgb(flat.colours).astype(np.float32)
        owners = [index for index, segment in enumerate(model.segments) for _ in segment.parts]
        is_faceted = np.array([has_flat_sides(part.shape) for part in model.parts])
        shapes, axes = new_shapes(flat), _free_axes(model)
        return cls(model, flat, shapes, np.array(owners, np.int16), albedo, is_faceted, axes, lights)

    @property
    def body(self) -> tuple:
        """What the kernels take of the body."""
        return self.shapes, self.geometry, self.segment_of_part

    def place(self, pose: Pose) -> PosedBody:
        """Place the body; the same as `BodyModel.with_pose`."""
        root = pose.world_from_root
        joints = pose.joint_angles if pose.joint_angles.size else np.zeros((len(self.model.segments) - 1, 3))
        R, t = place_segments(self.model, root.rotation.as_matrix()[None], root.translation[None], joints[None])
        return PosedBody(self.model, R[0], t[0])

    def jacobian(self, posed: PosedBody, freedom: Freedom) -> Array:
        """Return how the segments move about the root's origin, without turns that change no picture: (s, 6, d)."""
        J = freedom.jacobian(posed, posed.t[0])
        for segment, axes in self.free_axes.items():
            hidden = axes @ posed.R[0].T if segment == 0 else axes  # the root turns about the world's axes
            columns = np.flatnonzero((freedom.columns >= 3 + 3 * segment) & (freedom.columns < 6 + 3 * segment))
            if len(columns):
                J[..., columns] = J[..., columns] @ (np.eye(3) - hidden.T @ hidden)
        return J

    def parts(self, posed: PosedBody, region: Region) -> NDArray[np.int16]:
        """Draw which part each pixel of a region shows: (h, w), -1 where none."""
        maps = empty_maps(region.camera.size)
        surface_maps(self.shapes, self.geometry, posed.R, posed.t, region.packed, *maps)
        return maps[0]

    def window(self, bodies: Sequence[PosedBody], camera: Camera, packed: Array) -> Window:
        """Return the part of a picture that holds the bodies with room to move; empty where nothing is seen."""
        maps = empty_maps(camera.size)
        found = []
        for posed in bodies:
            surface_maps(self.shapes, self.geometry, posed.R, posed.t, packed, *maps)
            found.append(window_of(maps[0]))
        found = np.array([window for window in found if window[2] > window[0]])
        if not len(found):
            return 0, 0, 0, 0
        (x0, y0), (x1, y1) = found[:, :2].min(axis=0).tolist(), found[:, 2:].max(axis=0).tolist()
        width, height = camera.size
        room_v = round(_ROOM_PX * camera.K[1, 1] / camera.K[0, 0])
        return max(x0 - _ROOM_PX, 0), max(y0 - room_v, 0), min(x1 + _ROOM_PX, width), min(y1 + room_v, height)


def _free_axes(model: BodyModel) -> dict[int, Array]:
    """Find the segments at the ends of the body that are round about an axis through their joint."""
    found = {}
    for index in set(range(len(model.segments))) - set(model.parents.tolist()):
        segment = model.segments[index]
        if segment.parts:
            alone = BodyModel(segment.name, (replace(segment, parent=None),))
            found[index] = continuous_axes(alone)
    return {index: axes for index, axes in found.items() if len(axes)}


class Laid(NamedTuple):
    """A view laid out for the kernels; see `normal_equations` for what they take."""

    packed: Array
    K: Array
    seen: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
    maps: Any
    window: Window
    light: Any = None  # (3, TERMS) to be fitted, or lamps (l, 8) and the ambient light

    @property
    def is_seen(self) -> bool:
        """Whether the body is in the picture."""
        x0, y0, x1, y1 = self.window
        return x1 - x0 >= 3 and y1 - y0 >= 3


def pictured(synthesis: Synthesis, bodies: Sequence[PosedBody], region: Region, appearance: Appearance) -> Laid:
    """Lay out a region: linear light where the lights are unknown, shares of full sRGB where they are known."""
    mean, sd, looks = appearance.scene(region)
    filled = np.empty_like(mean)
    if not fill(mean, looks, filled):
        filled[:] = region.rgb
    table = TO_LIGHT if synthesis.lights is None else _TO_SHARE
    observed, scene = np.empty((2, 3, *sd.shape), np.float32)
    light_planes(region.rgb, table, observed)
    light_planes(filled, table, scene)
    certainty = np.minimum(1, (START_SD / sd) ** 2)
    if synthesis.lights is None:
        light: Any = np.zeros((3, TERMS), np.float32)
        light[:, 0] = 1
    else:
        light = packed_lights(synthesis.lights, region.camera), np.float32(synthesis.lights.ambient)
    window = synthesis.window(bodies, region.camera, region.packed)
    maps = empty_maps(region.camera.size)
    return Laid(region.packed, region.camera.K, (observed, scene, certainty), maps, window, light)


def outlined(synthesis: Synthesis, posed: PosedBody, region: Region, posterior: Array, reduction: int) -> Laid:
    """Lay out a reduced region."""
    camera, plane = reduced_region(region, posterior, reduction)
    seen = plane[None], np.zeros((1, *plane.shape), np.float32), np.ones_like(plane)
    packed = packed_view(camera)
    window = synthesis.window([posed], camera, packed)
    return Laid(packed, camera.K, seen, empty_maps(camera.size), window)


def reduced_region(region: Region, plane: Array, reduction: int) -> tuple[Camera, NDArray[np.float32]]:
    """Reduce a plane (h, w) of a region by averaging areas to about square pixels; return its camera and itself."""
    rows = max(1, round(reduction * region.aspect))
    height, width = plane.shape
    size = (max(width // reduction, 1), max(height // rows, 1))
    small = cv2.resize(plane[: size[1] * rows, : size[0] * reduction], size, interpolation=cv2.INTER_AREA)
    middle = ((reduction - 1) / 2, (rows - 1) / 2)
    return region.camera.resampled(scale=(reduction, rows), offset=middle, size=size), np.asarray(small, np.float32)


def shifts_px(region: Region) -> Array:
    """Return the sds of a picture's shift right and down, in its own pixels, and of its outline's width: (3,) [px]."""
    shift_px = np.hypot(SHIFT_SD_PX, region.camera.shift_sd_px)
    return np.array([shift_px, shift_px * region.aspect, SHIFT_SD_PX])
