"""Images of a scene, rendered in linear light and recorded as sRGB."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose, PosedBody, SurfaceArrays, surface_arrays
from airborne.cameras import Camera
from airborne.rendering import FLAT, render
from airborne.rendering.maps import surface_maps
from airborne.rendering.packing import pack_view
from airborne.rendering.shapes import new_shapes
from airborne.rendering.srgb import light_from_srgb, srgb_from_light
from airborne.synthetic.throw.exact import exact_frames
from airborne.synthetic.throw.light import boxes_of, ellipsoids_of, is_lit, spot_irradiance
from airborne.synthetic.throw.scene import Scene
from airborne.types import Array, Array32
from airborne.video import Frames, View

_BODY_SAMPLES, _BACKGROUND_SAMPLES = 3, 2  # supersampling of a pixel's side
_FEWEST_SAMPLES, _SAMPLE_S = 3, 0.001  # times within an exposure: at least so many, no further apart
_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))  # (8, 3) of a box's corners
_SHARED_NOISE = 0.9  # share of the noise's variance that the three channels have in common


class VisibleSurface(NamedTuple):
    """The surface of a body that a camera sees: n pixels, in world coordinates."""

    mask: NDArray[np.bool_]  # (h, w) where the n pixels are
    points: Array  # (n, 3) [m]
    normals: Array  # (n, 3) unit, outward
    albedo: Array  # (n, 3) linear RGB


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """The surroundings as one camera sees them, each light separately, so that a moving shadow can be cast on them."""

    camera: Camera
    points: Array  # (h, w, 3) world [m]
    normals: Array  # (h, w, 3) unit, world
    ambient: Array32  # (h, w, 3) linear light
    spots: Array32  # (spots, h, w, 3) linear light, past the surroundings


def scene_frames(scene: Scene) -> Iterator[Frames]:
    """Record the scene frame by frame: all cameras at once, fields with their own rows only, without compression.

    The same scene gives the same pixels, independent of what else is rendered.
    """
    if scene.lights is not None:
        yield from exact_frames(scene, scene.lights)
        return
    backgrounds = [background(scene, camera) for camera in scene.rig]
    cameras = [[camera.field(p) for p in (0, 1)] if scene.is_interlaced else [camera] for camera in scene.rig]
    n = max(_FEWEST_SAMPLES, int(np.ceil(scene.exposure_s / _SAMPLE_S)))
    offsets = (np.arange(n) - (n - 1) / 2) / n * scene.exposure_s
    times = np.array([float(scene.time_s(i)) for i in range(scene.n_recorded)])
    offsets_s = scene.time_offsets_s or (0.0,) * len(scene.rig)
    flights = {offset: scene.flight((times[:, None] + offsets + offset).ravel()) for offset in sorted(set(offsets_s))}
    for index in range(scene.n_recorded):
        moments = range(index * n, (index + 1) * n)
        bodies = {offset: [scene.body.with_pose(flight.pose(k)) for k in moments] for offset, flight in flights.items()}
        parity = scene.parity(index) if scene.is_interlaced else 0
        rows = slice(parity, None, 2) if scene.is_interlaced else slice(None)
        views = []
        for number, (backdrop, own) in enumerate(zip(backgrounds, cameras, strict=True)):
            light = linear_image(scene, backdrop, bodies[offsets_s[number]])[rows]
            rng = np.random.default_rng([scene.seed, 2, number, index])
            views.append(View(own[parity], _record(light, scene.noise_sd, rng)))
        yield Frames(index, scene.time_s(index), tuple(views))


def background(scene: Scene, camera: Camera) -> Background:
    """Render the surroundings for one camera, black where there are none."""
    n = _BACKGROUND_SAMPLES
    width, height = camera.size
    if scene.surroundings is None:
        black = np.zeros((len(scene.spots), height, width, 3), np.float32)
        none = np.zeros((height, width, 3))
        return Background(camera, none, none, none.astype(np.float32), black)
    posed = scene.surroundings.with_pose(Pose(world_from_root=RigidTransform.identity()))
    visible = visible_surface(surface_arrays(scene.surroundings), posed, _supersample(camera, n, (0, 0, width, height)))
    boxes = boxes_of(posed)
    spots = [
        spot_irradiance(spot, visible.points, visible.normals)
        * is_lit(visible.points, visible.normals, spot, boxes)[:, None]
        for spot in scene.spots
    ]
    points, normals = (_mean(_scatter(values, visible.mask), n) for values in (visible.points, visible.normals))
    lights = [scene.ambient.irradiance(visible.normals), *spots]
    ambient, *rest = (_mean(_scatter(light * visible.albedo, visible.mask), n).astype(np.float32) for light in lights)
    return Background(camera, points, normals, ambient, np.array(rest).reshape(-1, height, width, 3))


def linear_image(scene: Scene, backdrop: Background, bodies: Sequence[PosedBody]) -> Array32:
    """Render the whole frame (h, w, 3) in linear light: the mean of the posed bodies over the background."""
    light = _cast_shadow(scene, backdrop, bodies[len(bodies) // 2])
    x0, y0, x1, y1 = _region(scene.body, bodies, backdrop.camera)
    if x1 > x0 and y1 > y0:
        camera = _supersample(backdrop.camera, _BODY_SAMPLES, (x0, y0, x1, y1))
        shape = _surface_arrays(scene.body)
        coverage = np.zeros((y1 - y0, x1 - x0, 1))
        colour = np.zeros((y1 - y0, x1 - x0, 3))
        for posed in bodies:
            visible = visible_surface(shape, posed, camera)
            coverage += _mean(visible.mask[..., None].astype(float), _BODY_SAMPLES) / len(bodies)
            colour += _mean(_scatter(_radiance(scene, posed, visible), visible.mask), _BODY_SAMPLES) / len(bodies)
        light[y0:y1, x0:x1] = colour + (1 - coverage) * light[y0:y1, x0:x1]
    if scene.blur_px > 0:
        cv2.GaussianBlur(light, (0, 0), scene.blur_px, dst=light, borderType=cv2.BORDER_REPLICATE)
    return light


def visible_surface(shape: SurfaceArrays, posed: PosedBody, camera: Camera) -> VisibleSurface:
    """Find the points of a posed body at a camera's pixel centres; raises CalibrationError for a distorting lens."""
    width, height = camera.size
    part = np.empty((height, width), np.int16)
    inverse_depth = np.empty((height, width), np.float32)
    normals = np.empty((3, height, width), np.float32)
    surface_maps(new_shapes(shape), shape, posed.R, posed.t, pack_view(camera), part, inverse_depth, normals)
    if len(shape.ellipsoid_part):  # the maps hold the depth of an ellipsoid's outline, not of its surface
        inverse_depth = render(shape, posed, camera, FLAT).inverse_depth
    mask = (part >= 0) & (inverse_depth > 0)
    v, u = np.nonzero(mask)
    rays = np.column_stack([u, v, np.ones(len(u))]) @ np.linalg.inv(camera.K).T
    world_from_camera = camera.camera_from_world.inv()
    return VisibleSurface(
        mask=mask,
        points=world_from_camera.apply(rays / inverse_depth[mask][:, None].astype(float)),
        normals=normals[:, mask].T.astype(float) @ camera.camera_from_world.rotation.as_matrix(),
        albedo=light_from_srgb(shape.colours)[part[mask]],
    )


def _radiance(scene: Scene, posed: PosedBody, visible: VisibleSurface) -> Array:
    """Return the radiance (n, 3) of the body's surface; its parts shadow each other."""
    boxes, ellipsoids = _occluders(scene, posed)
    light = scene.ambient.irradiance(visible.normals)
    for spot in scene.spots:
        is_lit_by_spot = is_lit(visible.points, visible.normals, spot, boxes, ellipsoids=ellipsoids)
        light += spot_irradiance(spot, visible.points, visible.normals) * is_lit_by_spot[:, None]
    return light * visible.albedo


def _cast_shadow(scene: Scene, backdrop: Background, posed: PosedBody) -> Array32:
    """Return the background (h, w, 3) with the body's shadow on it."""
    light = backdrop.ambient.copy()
    boxes, ellipsoids = _occluders(scene, posed)
    points, normals = backdrop.points.reshape(-1, 3), backdrop.normals.reshape(-1, 3)
    for spot, part in zip(scene.spots, backdrop.spots, strict=True):
        light += part * is_lit(points, normals, spot, boxes, ellipsoids=ellipsoids).reshape(*part.shape[:2], 1)
    return light


def _occluders(scene: Scene, posed: PosedBody) -> tuple[Array, Array]:
    """Return the boxes and ellipsoids that block light; those of the tracking body where the rendered one is a mesh."""
    solid = PosedBody(scene.model, posed.R, posed.t)
    return boxes_of(solid), ellipsoids_of(solid)


def _record(light: Array32, noise_sd: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the sRGB image (h, w, 3) that a sensor records of linear light, clipped and with noise."""
    shared = rng.standard_normal((*light.shape[:2], 1), np.float32) * _SHARED_NOISE**0.5
    own = rng.standard_normal(light.shape, np.float32) * (1 - _SHARED_NOISE) ** 0.5
    return np.clip(srgb_from_light(light) + noise_sd * (shared + own) + 0.5, 0, 255).astype(np.uint8)


def _region(model: BodyModel, bodies: Sequence[PosedBody], camera: Camera) -> tuple[int, int, int, int]:
    """Return the region of the image, x0, y0, x1, y1, that holds a body; all of it if it reaches behind the camera."""
    segment, corners = _corners(_surface_arrays(model))
    points = [np.einsum("nij,nj->ni", b.R[segment], corners) + b.t[segment] for b in bodies]
    px = camera.px_from_world(np.concatenate(points))
    width, height = camera.size
    if not np.isfinite(px).all():
        return 0, 0, width, height
    (x0, y0), (x1, y1) = np.floor(px.min(axis=0)).astype(int), np.ceil(px.max(axis=0)).astype(int) + 1
    return max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)


def _corners(shape: SurfaceArrays) -> tuple[NDArray[np.int64], Array]:
    """Return points (n, 3) around the body, in the segments' frames, and their segments (n,)."""
    axes = shape.ellipsoid_axes * shape.ellipsoid_semi_axes[:, None, :]
    round_ellipsoids = shape.ellipsoid_centre[:, None] + np.einsum("eij,cj->eci", axes, _SIGNS)
    of_ellipsoids = np.repeat(shape.ellipsoid_segment, len(_SIGNS))
    of_polygons = np.repeat(shape.polygon_segment, np.diff(shape.start))
    return np.concatenate([of_polygons, of_ellipsoids]), np.concatenate(
        [shape.corners, round_ellipsoids.reshape(-1, 3)]
    )


@lru_cache(maxsize=4)
def _surface_arrays(model: BodyModel) -> SurfaceArrays:
    return surface_arrays(model)


def _supersample(camera: Camera, n: int, region: tuple[int, int, int, int]) -> Camera:
    """Return the camera of a region with n x n subpixels for each pixel."""
    x0, y0, x1, y1 = region
    first = (1 / n - 1) / 2
    return camera.resample(scale=(1 / n, 1 / n), offset=(x0 + first, y0 + first), size=(n * (x1 - x0), n * (y1 - y0)))


def _scatter(values: Array, mask: NDArray[np.bool_]) -> Array:
    """Scatter values (n, k) to where the mask (h, w) is true: (h, w, k), 0 elsewhere."""
    scattered = np.zeros((*mask.shape, values.shape[1]))
    scattered[mask] = values
    return scattered


def _mean(values: Array, n: int) -> Array:
    """Take the mean over blocks of n x n: (n h, n w, k) to (h, w, k)."""
    height, width, k = values.shape
    return values.reshape(height // n, n, width // n, n, k).mean(axis=(1, 3))
