"""A gym hall: boarded floor, three walls, and boxes, mats and panels as background clutter."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Part, Segment
from airborne.types import Array

_WALLS = {  # centre, size [m], sRGB
    "wall_back": ((0.0, 3.55, 3.0), (9.2, 0.1, 6.0), (142, 144, 151)),
    "wall_left": ((-4.55, -1.5, 3.0), (0.1, 10.0, 6.0), (136, 125, 119)),
    "wall_right": ((4.55, -1.5, 3.0), (0.1, 10.0, 6.0), (128, 135, 131)),
}
_BOARDS = np.arange(-4.0, 4.1, 1.0)  # their middles along x [m]
_BOARD_SRGB = np.array([152.0, 119.0, 90.0])  # wood
_COLOURS = np.array(
    [  # every third one is a yellow or near to it
        (206, 176, 92),
        (48, 74, 168),
        (70, 120, 82),
        (214, 190, 40),
        (150, 48, 50),
        (120, 166, 178),
        (188, 168, 120),
        (176, 92, 56),
        (96, 84, 92),
    ],
    float,
)
_FRONT_M = 1.6  # clutter stands behind this y, the flight is before it


def gym(rng: np.random.Generator, *, clutter: int) -> BodyModel:
    """Furnish a hall, x -4.5 to 4.5, y -6.5 to 3.5, floor at z = 0 [m], with `clutter` boxes and a third as many mats.

    The boxes stand or hang along the back wall, behind y = 1.6 m; the mats lie on the floor. A third of them is
    yellowish.
    """
    parts = [_part(name, *wall) for name, wall in _WALLS.items()]
    for i, x in enumerate(_BOARDS):
        parts.append(_part(f"board_{i}", (x, -1.5, -0.05), (1.0, 10.0, 0.1), _BOARD_SRGB * rng.uniform(0.9, 1.05)))
    for i in range(clutter):
        size = rng.uniform((0.3, 0.3, 0.25), (0.9, 0.8, 0.9))
        bottom = rng.choice([0.0, 0.0, rng.uniform(0.2, 1.8)])
        centre = (rng.uniform(-3.9, 3.9), rng.uniform(_FRONT_M + 0.6, 2.9), bottom + size[2] / 2)
        parts.append(_part(f"box_{i}", centre, size, _colour(rng, i), yaw_rad=rng.uniform(-0.6, 0.6)))
    for i in range(clutter // 3):
        size = np.append(rng.uniform((0.5, 0.4), (1.2, 0.9)), 0.02 + 0.004 * i)  # no two tops in one plane
        centre = (rng.uniform(-1.8, 1.8), rng.uniform(-1.6, 1.4), size[2] / 2)
        parts.append(_part(f"mat_{i}", centre, size, 0.8 * _colour(rng, i), yaw_rad=rng.uniform(-0.8, 0.8)))
    return BodyModel("gym", (Segment("gym", None, np.zeros(3), tuple(parts)),))


def _colour(rng: np.random.Generator, i: int) -> Array:
    return np.clip(_COLOURS[i % len(_COLOURS)] * rng.uniform(0.75, 1.05), 0, 255)


def _part(name: str, centre, size, colour, *, yaw_rad: float = 0.0) -> Part:
    segment_from_part = RigidTransform.from_components(centre, Rotation.from_euler("Z", yaw_rad))
    return Part(name, Box(np.array(size, float)), segment_from_part, np.array(colour, float))
