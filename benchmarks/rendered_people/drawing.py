"""The person in the images: light by rays against the own mesh, drawn over the background with soft edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numba
import numpy as np
from body import Body
from cameras import SIZE, Camera, project
from embreex.mesh_construction import TriangleMesh  # pyright: ignore[reportMissingImports]
from embreex.rtcore_scene import EmbreeScene  # pyright: ignore[reportMissingImports]
from people import Person

_N_RAYS = 160  # from each vertex, chosen
_FROM_OWN_SKIN = np.array([0.16, 0.12, 0.10])  # chosen: light of where a ray meets the own body, linear RGB
_WALLS, _FLOOR = np.array([0.36, 0.32, 0.27]), np.array([0.30, 0.27, 0.24])  # chosen: light of those, linear RGB
_SAMPLES = 3  # per pixel, along x and y, chosen
_EDGE_SD_PX = 0.4  # chosen: how soft a lens draws
_MARGIN_PX = 24  # around the person, chosen
_SPOTS, _SPOT_SD_PER_M, _SPOT_SHARE = 10, 25, 0.025  # chosen: waves of brightness on skin and cloth


class Patch(NamedTuple):
    """What changes in a camera's background in one frame."""

    x: int  # of its left column
    y: int  # of its top row
    pixels: np.ndarray  # (h, w, 3) uint8, sRGB


@dataclass(frozen=True, slots=True, kw_only=True)
class Painting:
    """What a person looks like and where the light comes from."""

    triangles: np.ndarray  # (t, 3) vertices
    materials: np.ndarray  # (t,)
    colours: np.ndarray  # (materials, 3) linear RGB
    spots: np.ndarray  # (v,) factors of brightness
    light: np.ndarray  # (rays, 3) linear RGB, from the directions of `_directions`


def painting_of(body: Body, person: Person, vertices_m: np.ndarray) -> Painting:
    """Return the painting of a person whose vertices are (v, 3) [m] in the first frame."""
    rng = np.random.default_rng(500 + person.seed)
    spots = np.ones(len(vertices_m))
    for _ in range(_SPOTS):
        wave_numbers = rng.normal(0, _SPOT_SD_PER_M, 3)
        spots += _SPOT_SHARE * np.sin(vertices_m @ wave_numbers + rng.uniform(0, 6))
    return Painting(
        triangles=np.concatenate([body.faces[:, [0, 1, 2]], body.faces[:, [0, 2, 3]]]),
        materials=np.concatenate([body.materials, body.materials]),
        colours=_linear(np.array(person.colours.by_material())),
        spots=spots,
        light=_light_of_hall() if person.light == "hall" else _light_of_window(),
    )


def read_background(path: str) -> np.ndarray:
    """Read a background (h, w, 3), linear RGB, as soft as the person is drawn."""
    pixels = cv2.imread(path)
    assert pixels is not None
    return cv2.GaussianBlur(_linear(pixels[:, :, ::-1]), (0, 0), _EDGE_SD_PX)


def to_pixels(linear: np.ndarray) -> np.ndarray:
    """Return linear RGB as sRGB, uint8."""
    light = np.clip(linear, 0, 1)
    shares = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)
    return (shares * 255 + 0.5).astype(np.uint8)


def draw_frame(
    painting: Painting, vertices_m: np.ndarray, cameras: list[Camera], backgrounds: list[np.ndarray]
) -> list[Patch]:
    """Return what a person with vertices (v, 3) [m] changes in each camera's background (linear RGB)."""
    light = _light_on(painting, vertices_m)
    patches = []
    for camera, background in zip(cameras, backgrounds, strict=True):
        px, depth_m = project(camera, vertices_m)
        x0, y0 = np.maximum(np.floor(px.min(axis=0) - _MARGIN_PX).astype(int), 0)
        x1, y1 = np.minimum(np.ceil(px.max(axis=0) + _MARGIN_PX).astype(int), SIZE)
        surface = light * painting.spots[:, None]
        in_patch = (px - [x0, y0] + 0.5) * _SAMPLES
        drawn = _rasterise(
            in_patch, depth_m, painting.triangles, painting.materials, painting.colours, surface, y1 - y0, x1 - x0
        )
        drawn = cv2.GaussianBlur(drawn, (0, 0), _EDGE_SD_PX)
        over = background[y0:y1, x0:x1] * (1 - drawn[:, :, 3:]) + drawn[:, :, :3]
        patches.append(Patch(int(x0), int(y0), to_pixels(over)))
    return patches


def _linear(srgb: np.ndarray) -> np.ndarray:
    shares = srgb / 255.0
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)


def _directions() -> np.ndarray:
    """Return directions evenly over the sphere, on Fibonacci's spiral: (rays, 3)."""
    i = np.arange(_N_RAYS) + 0.5
    from_top, around = np.arccos(1 - 2 * i / _N_RAYS), np.pi * (1 + 5**0.5) * i
    return np.stack([np.cos(around) * np.sin(from_top), np.sin(around) * np.sin(from_top), np.cos(from_top)], axis=1)


def _rise(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return a smooth step from 0 to 1, as a column."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return (t * t * (3 - 2 * t))[:, None]


def _light_of_room() -> np.ndarray:
    up = _directions()[:, 2]
    return _WALLS * (1 - _rise(np.abs(up), 0.3, 0.8)) + _FLOOR * _rise(-up, 0.2, 0.6)


def _light_of_hall() -> np.ndarray:
    """Return the light of two lamps and of windows at two walls, as hall.py has them: (rays, 3); all chosen."""
    directions, light = _directions(), _light_of_room()
    for lamp, strength in (((-0.45, 0.1, 0.9), 7.0), ((0.5, -0.3, 0.85), 6.0)):
        towards = directions @ (np.array(lamp) / np.linalg.norm(lamp))
        light += strength * _rise(towards, 0.93 - 0.06, 0.93 + 0.03) * np.array([1, 0.97, 0.92])
    x, y, up = directions.T
    windows = _rise(up, 0.1, 0.3) * (1 - _rise(up, 0.45, 0.6)) * (_rise(x, 0.3, 0.7) + _rise(y, 0.3, 0.7))
    return light + 0.5 * windows * np.array([0.9, 0.97, 1])


def _light_of_window() -> np.ndarray:
    """Return the light of one large window, a weak lamp and a wall's windows: (rays, 3); all chosen."""
    directions, light = _directions(), _light_of_room()
    towards = directions @ (np.array([0.9, 0.25, 0.38]) / np.linalg.norm([0.9, 0.25, 0.38]))
    _, y, up = directions.T
    light = light + 4.5 * _rise(towards, 0.78, 0.95) * np.array([0.95, 0.98, 1]) + 0.5 * _rise(up, 0.5, 0.9)
    return light + 0.5 * _rise(up, 0.1, 0.3) * (1 - _rise(up, 0.45, 0.6)) * _rise(y, 0.3, 0.7)


def _light_on(painting: Painting, vertices_m: np.ndarray) -> np.ndarray:
    """Return the light that falls on each vertex, less what the own body keeps off: (v, 3) linear RGB."""
    directions, corners = _directions(), vertices_m[painting.triangles]
    of_triangles = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices_m)
    for corner in painting.triangles.T:
        np.add.at(normals, corner, of_triangles)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    scene = EmbreeScene()
    TriangleMesh(scene, corners.astype(np.float32))
    cosines = normals @ directions.T
    vertex, ray = np.nonzero(cosines > 0.02)
    starts_m = vertices_m[vertex] + 3e-3 * normals[vertex] + 1e-3 * directions[ray]  # off the skin itself
    hits = scene.run(starts_m.astype(np.float32), directions[ray].astype(np.float32), query="OCCLUDED")
    is_hidden = (np.asarray(hits) != -1)[:, None]
    radiance = np.where(is_hidden, _FROM_OWN_SKIN, painting.light[ray])
    falling = cosines[vertex, ray][:, None] * radiance * (4 / _N_RAYS)
    return np.stack([np.bincount(vertex, falling[:, k], len(vertices_m)) for k in range(3)], axis=1)


@numba.njit(cache=True)
def _rasterise(px, depth_m, triangles, materials, colours, light, height, width):
    """Draw triangles with a depth buffer: (h, w, 4), linear RGB and coverage; px in samples from the patch's corner."""
    n = _SAMPLES
    nearest = np.full((height * n, width * n), 1e9)
    samples = np.zeros((height * n, width * n, 4))
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        ax, ay = px[a]
        bx, by = px[b]
        cx, cy = px[c]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-9:
            continue
        left, right = max(int(np.floor(min(ax, bx, cx) - 0.5)), 0), min(int(np.ceil(max(ax, bx, cx))), width * n - 1)
        top, bottom = max(int(np.floor(min(ay, by, cy) - 0.5)), 0), min(int(np.ceil(max(ay, by, cy))), height * n - 1)
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                sx, sy = x + 0.5 - ax, y + 0.5 - ay
                u = (sx * (cy - ay) - sy * (cx - ax)) / area
                v = ((bx - ax) * sy - (by - ay) * sx) / area
                w = 1 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                depth = w * depth_m[a] + u * depth_m[b] + v * depth_m[c]
                if depth < nearest[y, x]:
                    nearest[y, x] = depth
                    for k in range(3):
                        falling = w * light[a, k] + u * light[b, k] + v * light[c, k]
                        samples[y, x, k] = colours[materials[t], k] * falling
                    samples[y, x, 3] = 1
    pixels = np.zeros((height, width, 4))
    for y in range(height * n):
        for x in range(width * n):
            for k in range(4):
                pixels[y // n, x // n, k] += samples[y, x, k] / (n * n)
    return pixels
