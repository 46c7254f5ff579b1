"""A hall as one camera sees it: court, lines, stand with spectators, and the net as a separate layer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Camera
from airborne.synthetic.block.margins import NET_TOP_M
from airborne.types import Array, Image

_Colour = Sequence[float] | Array  # (3,) sRGB

COURT_M, _ATTACK_M, _LINE_M = (9.0, 18.0), 3.0, 0.05  # x and y of the court, attack line from the net, width of lines
_NET_M = (4.75, 1.0, 0.10)  # half length, depth, mesh
_ANTENNA_M = 0.80  # above the tape
_ORANGE, _BLUE, _WHITE, _WALL = (211, 143, 86), (118, 139, 160), (238, 238, 234), (92, 92, 99)  # sRGB
_CORD, _TAPE, _POLE = (34, 34, 38), (232, 232, 228), (42, 70, 150)  # sRGB
# sRGB of the spectators
_CLOTHES = np.array(
    [(180, 40, 44), (38, 66, 160), (34, 112, 60), (226, 190, 50), (28, 28, 32), (206, 206, 206), (205, 120, 46)]
)
_SKIN = np.array((190, 142, 112))  # sRGB
_NEAR_M = 0.3  # nothing nearer to a camera is drawn
_SUB = 4  # cv2 draws to 1/16 of a pixel
_CORD_ALPHA, _TAPE_ALPHA = 120, 250  # of 255


class Layer(NamedTuple):
    """A foreground layer: colour (h, w, 3) sRGB, and opacity (h, w), 0 to 255."""

    colour: Image
    alpha: Image


def hall_image(rng: np.random.Generator, camera: Camera, objects: Sequence[tuple[Array, _Colour]]) -> Image:
    """Draw everything static except the net: (h, w, 3) sRGB; `objects` as of `draw_clutter`."""
    width, height = camera.size
    image = np.full((height, width, 3), _WALL, np.uint8)
    for corners, colour in [*_walls(), *_floor()]:
        _fill(image, camera, corners, colour)
    for corners, colour in sorted(objects, key=lambda each: -each[0][:, 1].mean()):  # far from all cameras first
        _fill(image, camera, corners, colour)
    coarse = rng.normal(1.0, 0.02, (height // 45, width // 45)).astype(np.float32)
    cloud = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.clip(image * cloud[..., None] + 0.5, 0, 255).astype(np.uint8)


def net_layer(camera: Camera) -> Layer:
    """Draw the net with tapes, antennae and poles."""
    width, height = camera.size
    colour, alpha = np.full((height, width, 3), _CORD, np.uint8), np.zeros((height, width), np.uint8)
    half, depth, mesh = _NET_M
    top, bottom = NET_TOP_M, NET_TOP_M - depth
    for x in np.arange(-half, half + mesh / 2, mesh):
        _draw_line(alpha, camera, [[x, 0, bottom], [x, 0, top]], (_CORD_ALPHA,))
    for z in np.arange(bottom, top + mesh / 2, mesh):
        _draw_line(alpha, camera, [[-half, 0, z], [half, 0, z]], (_CORD_ALPHA,))
    for corners, own in [*_tapes(half, top, bottom), *_antennae(top, bottom), *_poles()]:
        _fill(colour, camera, corners, own)
        _fill(alpha, camera, corners, (_TAPE_ALPHA,))
    return Layer(colour, alpha)


def draw_clutter(rng: np.random.Generator) -> list[tuple[Array, _Colour]]:
    """Draw upright rectangles behind the court at random: steps, spectators, boards, boxes on the floor."""
    objects: list[tuple[Array, _Colour]] = []
    for row in range(7):
        y, z = 14.0 + 0.9 * row, 0.5 + 0.45 * row
        objects.append(
            (
                _upright_rectangle(0.0, y, z - 0.5, width=19.0 - 0.8 * row, height=0.5),
                (112 - 3 * row, 111 - 3 * row, 114 - 3 * row),
            )
        )
        for x in np.arange(-9.0 + 0.4 * row, 9.0 - 0.4 * row, 0.62):
            if rng.random() < 0.45:
                cloth = _CLOTHES[rng.integers(len(_CLOTHES))] * rng.uniform(0.7, 1.0)
                x += rng.normal(0, 0.06)
                objects.append((_upright_rectangle(x, y + 0.02, z, width=0.44, height=0.55), cloth))
                objects.append(
                    (_upright_rectangle(x, y + 0.01, z + 0.55, width=0.2, height=0.26), _SKIN * rng.uniform(0.6, 1.05))
                )
    for x in np.arange(-11.0, 11.1, 2.0):
        objects.append(
            (_upright_rectangle(x, 12.0, 0.0, width=1.96, height=0.9), _CLOTHES[rng.integers(len(_CLOTHES))])
        )
    for side in (-1, 1):
        for y in np.arange(-1.0, 11.1, 2.0):
            board = _upright_rectangle(0.0, 0.0, 0.0, width=1.96, height=0.9)[:, [1, 0, 2]] + [side * 9.6, y, 0]
            objects.append((board, _CLOTHES[rng.integers(len(_CLOTHES))] * 0.85))
        for _ in range(5):
            x, y = side * rng.uniform(6.2, 9.0), rng.uniform(-4.0, 9.0)
            size = rng.uniform((0.4, 0.25), (0.8, 0.6))
            objects.append(
                (
                    _upright_rectangle(x, y, 0.0, width=size[0], height=size[1]),
                    _CLOTHES[rng.integers(len(_CLOTHES))] * rng.uniform(0.7, 1.0),
                )
            )
    return objects


def _walls() -> Iterator[tuple[Array, _Colour]]:
    for side, shade in ((-1, 0.86), (1, 0.94)):
        corners = np.array([[side * 15.0, y, z] for y, z in ((-20, 0), (24, 0), (24, 12), (-20, 12))])
        yield corners, tuple(shade * c for c in _WALL)


def _floor() -> Iterator[tuple[Array, _Colour]]:
    yield _floor_rectangle(0.0, 2.0, 30.0, 44.0), _BLUE
    (width, length), line_width = COURT_M, _LINE_M
    yield _floor_rectangle(0.0, 0.0, width, length), _ORANGE
    for y in (-length / 2, -_ATTACK_M, 0.0, _ATTACK_M, length / 2):
        yield _floor_rectangle(0.0, y, width, line_width), _WHITE
    for x in (-width / 2, width / 2):
        yield _floor_rectangle(x, 0.0, line_width, length), _WHITE


def _tapes(half: float, top: float, bottom: float) -> Iterator[tuple[Array, _Colour]]:
    yield _upright_rectangle(0.0, 0.0, top - 0.07, width=2 * half, height=0.07), _TAPE
    yield _upright_rectangle(0.0, 0.0, bottom, width=2 * half, height=0.05), _TAPE


def _antennae(top: float, bottom: float) -> Iterator[tuple[Array, _Colour]]:
    for x in (-COURT_M[0] / 2, COURT_M[0] / 2):
        yield _upright_rectangle(x, 0.0, bottom, width=0.05, height=top - bottom), _TAPE
        for k in range(8):
            height = _ANTENNA_M / 8
            yield _upright_rectangle(x, 0.0, top + k * height, width=0.02, height=height), (_TAPE, (196, 44, 44))[k % 2]


def _poles() -> Iterator[tuple[Array, _Colour]]:
    for x in (-5.3, 5.3):
        yield _upright_rectangle(x, 0.0, 0.0, width=0.12, height=2.55), _POLE


def _floor_rectangle(x: float, y: float, width: float, length: float) -> Array:
    return np.array([[x + a * width / 2, y + b * length / 2, 0.0] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _upright_rectangle(x: float, y: float, z: float, *, width: float, height: float) -> Array:
    return np.array([[x + a * width / 2, y, z + b * height] for a, b in ((-1, 0), (1, 0), (1, 1), (-1, 1))])


def _fill(image: Image, camera: Camera, corners: Array, colour: _Colour) -> None:
    px = _project(camera, corners, is_closed=True)
    if len(px) > 2:
        cv2.fillConvexPoly(image, px, [float(c) for c in colour], cv2.LINE_AA, _SUB)


def _draw_line(image: Image, camera: Camera, ends: Sequence[Sequence[float]], colour: _Colour) -> None:
    px = _project(camera, np.array(ends, float), is_closed=False)
    if len(px) == 2:
        cv2.line(image, px[0].tolist(), px[1].tolist(), [float(c) for c in colour], 1, cv2.LINE_AA, _SUB)


def _project(camera: Camera, corners: Array, *, is_closed: bool) -> NDArray[np.int32]:
    """Project a polygon or a line after cutting off what is behind the camera: in cv2's fractions of pixels."""
    xyz = camera.camera_from_world.apply(corners)
    clipped = []
    for k in range(len(xyz)):
        a, b = xyz[k], xyz[(k + 1) % len(xyz)]
        if a[2] >= _NEAR_M:
            clipped.append(a)
        if (is_closed or k + 1 < len(xyz)) and (a[2] >= _NEAR_M) != (b[2] >= _NEAR_M):
            clipped.append(a + (b - a) * (_NEAR_M - a[2]) / (b[2] - a[2]))
    if not clipped:
        return np.zeros((0, 2), np.int32)
    polygon = np.array(clipped)
    px = (polygon[:, :2] / polygon[:, 2:]) @ camera.K[:2, :2].T + camera.K[:2, 2]
    return np.round(np.clip(px, -2000, 5000) * 2**_SUB).astype(np.int32)
