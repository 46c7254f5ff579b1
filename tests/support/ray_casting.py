"""The maps of `render` by one ray a pixel, in float64 and plain NumPy: slow, independent of the kernels."""

from __future__ import annotations

import numpy as np

from airborne.body import PosedBody, SurfaceArrays
from airborne.cameras import Camera
from airborne.rendering.drawing import Rendering
from airborne.rendering.lights import Lamp, Lights
from airborne.types import Array


def render_reference(geometry: SurfaceArrays, posed: PosedBody, camera: Camera, lights: Lights) -> Rendering:
    """Draw a body in one view by casting rays: float64 maps, seconds for a large view; see `render`."""
    width, height = camera.size
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(camera.K).T  # (h, w, 3), z = 1
    R = camera.camera_from_world.rotation.as_matrix() @ posed.R
    t = camera.camera_from_world.apply(posed.t)
    depth, shape = np.full((height, width), np.inf), np.full((height, width), -1)
    normals = np.zeros((height, width, 3))
    hits = [_ellipsoid_hits(geometry, R, t, e=e, rays=rays) for e in range(len(geometry.ellipsoid_segment))]
    hits += [_polygon_hits(geometry, R, t, p=p, rays=rays) for p in range(len(geometry.polygon_segment))]
    for index, (z, normal) in enumerate(hits):
        is_nearer = z < depth
        depth[is_nearer], shape[is_nearer] = z[is_nearer], index
        normals[is_nearer] = np.broadcast_to(normal, normals.shape)[is_nearer]
    parts = np.append(np.concatenate([geometry.ellipsoid_part, geometry.polygon_part]), -1)
    segments = np.append(np.concatenate([geometry.ellipsoid_segment, geometry.polygon_segment]), -1)
    mask = shape >= 0
    colour = np.zeros((height, width, 3))
    points = rays[mask] * depth[mask][:, None]
    light = lights.ambient + sum(
        (_lamp_light(lamp, camera, points, normals[mask]) for lamp in lights.lamps), np.zeros(1)
    )
    colour[mask] = np.broadcast_to(light, len(points))[:, None] * geometry.colours[parts[shape[mask]]]
    return Rendering(
        (0, 0, width, height),
        parts[shape].astype(np.int16),
        segments[shape].astype(np.int16),
        np.where(mask, 1 / depth, 0.0),
        colour,
    )


def _ellipsoid_hits(geometry: SurfaceArrays, R: Array, t: Array, *, e: int, rays: Array) -> tuple[Array, Array]:
    """Return each ray's depth [m] at the near surface, infinite where it misses, and the outward normals (h, w, 3)."""
    segment = geometry.ellipsoid_segment[e]
    centre = R[segment] @ geometry.ellipsoid_centre[e] + t[segment]
    axes = R[segment] @ geometry.ellipsoid_axes[e]
    semi, slab = geometry.ellipsoid_semi_axes[e], geometry.ellipsoid_slab[e]
    if centre[2] <= np.linalg.norm(axes[2] * semi):  # it reaches the camera's plane
        return np.full(rays.shape[:2], np.inf), np.zeros(3)
    ray_in_sphere, origin_in_sphere = rays @ axes / semi, -centre @ axes / semi
    a = np.sum(ray_in_sphere**2, axis=-1)
    b = ray_in_sphere @ origin_in_sphere
    c = origin_in_sphere @ origin_in_sphere - 1
    root = b * b - a * c
    depth = np.where(root >= 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    on_sphere = np.where(root[..., None] >= 0, origin_in_sphere + ray_in_sphere * ((-b / a)[..., None]), 0)
    on_sphere = on_sphere - ray_in_sphere * (np.sqrt(np.maximum(root, 0)) / a)[..., None]
    normals = (on_sphere / semi) @ axes.T
    height = on_sphere[..., 2] * semi[2]
    depth = np.where((slab[0] <= height) & (height <= slab[1]), depth, np.inf)
    return depth, normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)


def _polygon_hits(geometry: SurfaceArrays, R: Array, t: Array, *, p: int, rays: Array) -> tuple[Array, Array]:
    """Return each ray's depth [m] at the polygon, infinite where it misses or sees its back, and normals to shade with.

    The normals are one, (3,), or of a smooth triangle (h, w, 3).
    """
    segment = geometry.polygon_segment[p]
    corners = geometry.corners[geometry.start[p] : geometry.start[p + 1]] @ R[segment].T + t[segment]
    normal = R[segment] @ geometry.normals[p]
    distance = normal @ corners[0]
    miss = np.full(rays.shape[:2], np.inf)
    if distance >= 0:
        return miss, normal
    facing = rays @ normal
    depth = np.divide(distance, facing, out=miss, where=facing < 0)
    points = rays * np.where(np.isfinite(depth), depth, 0)[..., None]
    for corner, following in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        depth = np.where(np.cross(following - corner, points - corner) @ normal >= 0, depth, np.inf)
    if geometry.is_smooth[p]:
        nearness = points @ np.linalg.inv(corners)
        normals = nearness @ geometry.corner_normals[geometry.start[p] : geometry.start[p + 1]] @ R[segment].T
        return depth, normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300)
    return depth, normal


def _lamp_light(lamp: Lamp, camera: Camera, points: Array, normals: Array) -> Array:
    """Return what a lamp adds at points (n, 3) [m] with unit normals (n, 3), camera axes: (n,)."""
    to_lamp = camera.camera_from_world.apply(lamp.position_m) - points
    to_lamp = to_lamp / np.linalg.norm(to_lamp, axis=1, keepdims=True)
    light = lamp.intensity * np.maximum(np.sum(normals * to_lamp, axis=1), 0)
    if lamp.direction is None or lamp.half_angle_rad is None:
        return light
    axis = camera.camera_from_world.rotation.apply(lamp.direction) / np.linalg.norm(lamp.direction)
    return np.where(-to_lamp @ axis >= np.cos(lamp.half_angle_rad), light, 0)
