"""Pictures of a scene, drawn in linear light and recorded as sRGB."""

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

from airborne.body import BodyModel, Geometry, Pose, PosedBody, geometry
from airborne.cameras import Camera
from airborne.rendering import FLAT, render
from airborne.rendering.maps import surface_maps
from airborne.rendering.packing import packed_view
from airborne.rendering.shapes import new_shapes
from airborne.rendering.srgb import light_from_srgb, srgb_from_light
from airborne.synthetic.throw.exact import exact_frames
from airborne.synthetic.throw.light import balls_of, boxes_of, is_lit, spot_light
from airborne.synthetic.throw.scene import Scene
from airborne.video import Frames, View

Array = NDArray[np.floating]

_BODY_SAMPLES, _BACKGROUND_SAMPLES = 3, 2  # a pixel's side is cut into so many
_EXPOSURE_SAMPLES = 3  # moments within an exposure
_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))  # (8, 3) of a box's corners
_SHARED_NOISE = 0.9  # part of the noise's variance that the three channels share


class Surface(NamedTuple):
    """What a camera sees of a body: n pixels, in world coordinates."""

    mask: NDArray[np.bool_]  # (h, w) where the n pixels are
    points: Array  # (n, 3) [m]
    normals: Array  # (n, 3) unit, outward
    albedo: Array  # (n, 3) linear RGB


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """The surroundings as one camera sees them, each light by itself, so that a moving shadow can be cast on them."""

    camera: Camera
    points: Array  # (h, w, 3) world [m]
    normals: Array  # (h, w, 3) unit, world
    ambient: NDArray[np.float32]  # (h, w, 3) linear light
    spots: NDArray[np.float32]  # (spots, h, w, 3) linear light, past the surroundings


def frames(scene: Scene) -> Iterator[Frames]:
    """Record the scene picture by picture: all cameras at once, fields with their own rows only, without compression.

    The same scene gives the same pixels, whatever is drawn before or beside it.
    """
    if scene.lights is not None:
        yield from exact_frames(scene, scene.lights)
        return
    backgrounds = [background(scene, camera) for camera in scene.rig]
    cameras = [[camera.field(p) for p in (0, 1)] if scene.is_interlaced else [camera] for camera in scene.rig]
    offsets = (np.arange(_EXPOSURE_SAMPLES) - (_EXPOSURE_SAMPLES - 1) / 2) / _EXPOSURE_SAMPLES * scene.exposure_s
    times = np.array([float(scene.time_s(i)) for i in range(scene.n_shown)])
    late_s = scene.late_s or (0.0,) * len(scene.rig)
    flights = {late: scene.flight((times[:, None] + offsets + late).ravel()) for late in sorted(set(late_s))}
    for index in range(scene.n_shown):
        first = index * _EXPOSURE_SAMPLES
        moments = range(first, first + _EXPOSURE_SAMPLES)
        exposed = {late: [scene.body.with_pose(flight.pose(k)) for k in moments] for late, flight in flights.items()}
        parity = scene.parity(index) if scene.is_interlaced else 0
        rows = slice(parity, None, 2) if scene.is_interlaced else slice(None)
        views = []
        for number, (backdrop, own) in enumerate(zip(backgrounds, cameras, strict=True)):
            light = linear_picture(scene, backdrop, exposed[late_s[number]])[rows]
            rng = np.random.default_rng([scene.seed, 2, number, index])
            views.append(View(own[parity], _recorded(light, scene.noise_sd, rng)))
        yield Frames(index, scene.time_s(index), tuple(views))


def background(scene: Scene, camera: Camera) -> Background:
    """Light the surroundings for one camera; what it sees beside them is black."""
    n = _BACKGROUND_SAMPLES
    width, height = camera.size
    if scene.surroundings is None:
        black = np.zeros((len(scene.spots), height, width, 3), np.float32)
        none = np.zeros((height, width, 3))
        return Background(camera, none, none, none.astype(np.float32), black)
    still = scene.surroundings.with_pose(Pose(world_from_root=RigidTransform.identity()))
    seen = surface(geometry(scene.surroundings), still, _sampled(camera, n, (0, 0, width, height)))
    boxes = boxes_of(still)
    spots = [
        spot_light(spot, seen.points, seen.normals) * is_lit(seen.points, seen.normals, spot, boxes)[:, None]
        for spot in scene.spots
    ]
    place, normals = (_mean(_spread(values, seen.mask), n) for values in (seen.points, seen.normals))
    lights = [scene.ambient.on(seen.normals), *spots]
    ambient, *rest = (_mean(_spread(light * seen.albedo, seen.mask), n).astype(np.float32) for light in lights)
    return Background(camera, place, normals, ambient, np.array(rest).reshape(-1, height, width, 3))


def linear_picture(scene: Scene, backdrop: Background, exposed: Sequence[PosedBody]) -> NDArray[np.float32]:
    """Draw the whole frame (h, w, 3) in linear light: the mean of the poses, before the background and its shadow."""
    light = _shadowed(scene, backdrop, exposed[len(exposed) // 2])
    x0, y0, x1, y1 = _region(scene.body, exposed, backdrop.camera)
    if x1 > x0 and y1 > y0:
        camera = _sampled(backdrop.camera, _BODY_SAMPLES, (x0, y0, x1, y1))
        flat = _flat(scene.body)
        coverage = np.zeros((y1 - y0, x1 - x0, 1))
        colour = np.zeros((y1 - y0, x1 - x0, 3))
        for posed in exposed:
            seen = surface(flat, posed, camera)
            coverage += _mean(seen.mask[..., None].astype(float), _BODY_SAMPLES) / len(exposed)
            colour += _mean(_spread(_lit(scene, posed, seen), seen.mask), _BODY_SAMPLES) / len(exposed)
        light[y0:y1, x0:x1] = colour + (1 - coverage) * light[y0:y1, x0:x1]
    if scene.blur_px > 0:
        cv2.GaussianBlur(light, (0, 0), scene.blur_px, dst=light, borderType=cv2.BORDER_REPLICATE)
    return light


def surface(flat: Geometry, posed: PosedBody, camera: Camera) -> Surface:
    """Find the points of a posed body that a camera's pixel centres see; raises CalibrationError for a bent lens."""
    width, height = camera.size
    part = np.empty((height, width), np.int16)
    inverse_depth = np.empty((height, width), np.float32)
    normals = np.empty((3, height, width), np.float32)
    surface_maps(new_shapes(flat), flat, posed.R, posed.t, packed_view(camera), part, inverse_depth, normals)
    if len(flat.ellipsoid_part):  # the maps hold the depth of an ellipsoid's outline, not of its surface
        inverse_depth = render(flat, posed, camera, FLAT).inverse_depth
    mask = (part >= 0) & (inverse_depth > 0)
    v, u = np.nonzero(mask)
    rays = np.column_stack([u, v, np.ones(len(u))]) @ np.linalg.inv(camera.K).T
    world_from_camera = camera.camera_from_world.inv()
    return Surface(
        mask=mask,
        points=world_from_camera.apply(rays / inverse_depth[mask][:, None].astype(float)),
        normals=normals[:, mask].T.astype(float) @ camera.camera_from_world.rotation.as_matrix(),
        albedo=light_from_srgb(flat.colours)[part[mask]],
    )


def _lit(scene: Scene, posed: PosedBody, seen: Surface) -> Array:
    """Return the light (n, 3) that the body's surface sends out; its parts shadow each other."""
    blockers = _blockers(scene, posed)
    light = scene.ambient.on(seen.normals)
    for spot in scene.spots:
        is_free = is_lit(seen.points, seen.normals, spot, *blockers)
        light += spot_light(spot, seen.points, seen.normals) * is_free[:, None]
    return light * seen.albedo


def _shadowed(scene: Scene, backdrop: Background, posed: PosedBody) -> NDArray[np.float32]:
    """Return the background (h, w, 3) with the body's shadow on it."""
    light = backdrop.ambient.copy()
    blockers = _blockers(scene, posed)
    points, normals = backdrop.points.reshape(-1, 3), backdrop.normals.reshape(-1, 3)
    for spot, part in zip(scene.spots, backdrop.spots, strict=True):
        light += part * is_lit(points, normals, spot, *blockers).reshape(*part.shape[:2], 1)
    return light


def _blockers(scene: Scene, posed: PosedBody) -> tuple[Array, Array]:
    """Return the boxes and balls that keep light away, those of the simple body where the one drawn is a mesh."""
    solid = PosedBody(scene.model, posed.R, posed.t)
    return boxes_of(solid), balls_of(solid)


def _recorded(light: NDArray[np.float32], noise_sd: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the sRGB picture (h, w, 3) that a sensor makes of linear light, clipped and with noise."""
    shared = rng.standard_normal((*light.shape[:2], 1), np.float32) * _SHARED_NOISE**0.5
    own = rng.standard_normal(light.shape, np.float32) * (1 - _SHARED_NOISE) ** 0.5
    return np.clip(srgb_from_light(light) + noise_sd * (shared + own) + 0.5, 0, 255).astype(np.uint8)


def _region(model: BodyModel, exposed: Sequence[PosedBody], camera: Camera) -> tuple[int, int, int, int]:
    """Return the part of the image, x0, y0, x1, y1, that holds a body; the whole, if it reaches behind."""
    segment, corners = _corners(_flat(model))
    placed = [np.einsum("nij,nj->ni", b.R[segment], corners) + b.t[segment] for b in exposed]
    px = camera.px_from_world(np.concatenate(placed))
    width, height = camera.size
    if not np.isfinite(px).all():
        return 0, 0, width, height
    (x0, y0), (x1, y1) = np.floor(px.min(axis=0)).astype(int), np.ceil(px.max(axis=0)).astype(int) + 1
    return max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)


def _corners(flat: Geometry) -> tuple[NDArray[np.int64], Array]:
    """Return points (n, 3) round the body, in the segments' frames, and their segments (n,)."""
    axes = flat.ellipsoid_axes * flat.ellipsoid_semi_axes[:, None, :]
    round_ellipsoids = flat.ellipsoid_centre[:, None] + np.einsum("eij,cj->eci", axes, _SIGNS)
    of_ellipsoids = np.repeat(flat.ellipsoid_segment, len(_SIGNS))
    of_polygons = np.repeat(flat.polygon_segment, np.diff(flat.start))
    return np.concatenate([of_polygons, of_ellipsoids]), np.concatenate([flat.corners, round_ellipsoids.reshape(-1, 3)])


@lru_cache(maxsize=4)
def _flat(model: BodyModel) -> Geometry:
    return geometry(model)


def _sampled(camera: Camera, n: int, region: tuple[int, int, int, int]) -> Camera:
    """Return the camera of a region with n x n pixels in place of each one."""
    x0, y0, x1, y1 = region
    first = (1 / n - 1) / 2
    return camera.resampled(scale=(1 / n, 1 / n), offset=(x0 + first, y0 + first), size=(n * (x1 - x0), n * (y1 - y0)))


def _spread(values: Array, mask: NDArray[np.bool_]) -> Array:
    """Put values (n, k) where the mask (h, w) is true: (h, w, k), 0 elsewhere."""
    spread = np.zeros((*mask.shape, values.shape[1]))
    spread[mask] = values
    return spread


def _mean(values: Array, n: int) -> Array:
    """Take the mean over blocks of n x n: (n h, n w, k) to (h, w, k)."""
    height, width, k = values.shape
    return values.reshape(height // n, n, width // n, n, k).mean(axis=(1, 3))
