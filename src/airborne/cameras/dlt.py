"""The direct linear transformation: 11 numbers that map the world to one image. Arrays only.

`u = (L1 X + L2 Y + L3 Z + L4) / (L9 X + L10 Y + L11 Z + 1)`, v likewise with L5..L8. Kept here as the matrix P (3, 4)
of the same numbers, scaled so that its third row gives the depth in metres: valid even where L12 = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.types import Array

FEWEST_DLT_POINTS = 6  # needed for 11 numbers


@dataclass(frozen=True, slots=True, eq=False)
class Decomposition:
    """What a projection matrix says about the camera: x right, y down, z forward.

    `R` is orthogonal; its determinant is -1 where no real camera fits because the world or the image is mirrored.
    """

    K: Array  # (3, 3) [px]
    R: Array  # (3, 3), camera from world
    centre: Array  # (3,) [m], in the world

    @property
    def is_mirrored(self) -> bool:
        """Whether the rotation is left-handed."""
        return bool(np.linalg.det(self.R) < 0)


def fit_dlt(world: Array, px: Array) -> Array:
    """Return the P (3, 4) that maps world (n, 3) [m] to px (n, 2) [px] with the least algebraic error; n >= 6.

    Both sides are first moved to their mean and scaled to unit spread, which conditions the equations. The points lie
    in front of the camera: P's sign is chosen so that most depths are positive.
    """
    assert len(world) == len(px) >= FEWEST_DLT_POINTS
    world_mean, px_mean = world.mean(axis=0), px.mean(axis=0)
    world_spread, px_spread = np.std(world - world_mean), np.std(px - px_mean)
    points = np.column_stack([(world - world_mean) / world_spread, np.ones(len(world))])
    u, v = ((px - px_mean) / px_spread).T
    zero = np.zeros_like(points)
    rows = np.vstack([np.hstack([points, zero, -u[:, None] * points]), np.hstack([zero, points, -v[:, None] * points])])
    unit_P = np.linalg.svd(rows, full_matrices=False)[2][-1].reshape(3, 4)
    unit_from_world = np.eye(4) / world_spread
    unit_from_world[:3, 3], unit_from_world[3, 3] = -world_mean / world_spread, 1
    px_from_unit = np.diag([px_spread, px_spread, 1.0])
    px_from_unit[:2, 2] = px_mean
    P = px_from_unit @ unit_P @ unit_from_world
    P = P / np.linalg.norm(P[2, :3])
    return P if np.median(world @ P[2, :3] + P[2, 3]) > 0 else -P


def dlt_coefficients(P: Array) -> Array:
    """Return L1..L11 (11,) of P (3, 4): P divided by its last element."""
    return (P / P[2, 3]).ravel()[:11]


def decompose(P: Array) -> Decomposition:
    """Split P (3, 4) into K, R and centre, in the classical closed form.

    The axes are the rows of P without their component along the optical axis. Skew is dropped and R made orthogonal; a
    P without skew is `K R [I | -centre]` exactly.
    """
    r3 = P[2, :3] / np.linalg.norm(P[2, :3])
    P = P / np.linalg.norm(P[2, :3])
    u0, v0 = P[:2, :3] @ r3
    f_u = np.sqrt(P[0, :3] @ P[0, :3] - u0**2)
    f_v = np.sqrt(P[1, :3] @ P[1, :3] - v0**2)
    rows = np.stack([(P[0, :3] - u0 * r3) / f_u, (P[1, :3] - v0 * r3) / f_v, r3])
    left, _, right = np.linalg.svd(rows)
    K = np.array([[f_u, 0, u0], [0, f_v, v0], [0, 0, 1]])
    return Decomposition(K, left @ right, np.asarray(-np.linalg.solve(P[:, :3], P[:, 3]), float))


def decompose_with_skew(P: Array) -> Decomposition:
    """Split P (3, 4), of either sign, into K with skew, R and centre: all eleven numbers are kept.

    RQ decomposition by Gram-Schmidt, beginning with the optical axis. P's sign is chosen so that R is a rotation.
    """
    P = P / np.linalg.norm(P[2, :3]) * np.sign(np.linalg.det(P[:, :3]))
    right, down, r3 = P[:, :3]
    u0, v0 = right @ r3, down @ r3
    down = down - v0 * r3
    r2 = down / np.linalg.norm(down)
    skew = right @ r2
    r1 = np.cross(r2, r3)
    K = np.array([[right @ r1, skew, u0], [0, np.linalg.norm(down), v0], [0, 0, 1]])
    return Decomposition(K, np.stack([r1, r2, r3]), np.asarray(-np.linalg.solve(P[:, :3], P[:, 3]), float))
