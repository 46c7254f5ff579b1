"""World frames by three points or by a thrown body's fall, and rigs of several sources merged.

A frame is given as `new_from_old`, the rigid map from the cameras' present world to the requested one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Rig
from airborne.constants import STANDARD_GRAVITY_M_S2
from airborne.errors import CalibrationError, count
from airborne.geometry.robust import SD_OF_MEDIAN_DEVIATION
from airborne.types import Array

_NEAREST_M = 0.05  # least distance of points that define an axis
_LEAST_ANGLE = np.radians(5)  # between the axis and the third point
_FEWEST_TIMES = 6  # of a throw
_SHORTEST_FALL_M = 0.1  # least sagitta of a throw that determines down


def frame_of_three_points(origin: Array, along_x: Array, in_xy: Array) -> RigidTransform:
    """Return new_from_old of the world with this origin, x toward the second point and the third with y > 0.

    Points (3,) in the old world [m]; z = x cross y. Raises CalibrationError where they are nearly collinear.
    """
    x, side = np.asarray(along_x - origin, float), np.asarray(in_xy - origin, float)
    lengths = np.linalg.norm(x), np.linalg.norm(side)
    if not np.all(np.isfinite([*x, *side])):
        raise CalibrationError("a point of the world's frame was not found: two cameras at least must see each of them")
    if min(lengths) < _NEAREST_M:
        raise CalibrationError(
            f"points of the world's frame stand {min(lengths):.3f} m apart; choose some more than {_NEAREST_M} m apart"
        )
    z = np.cross(x, side)
    if np.linalg.norm(z) < np.sin(_LEAST_ANGLE) * lengths[0] * lengths[1]:
        raise CalibrationError(
            "the world's origin, its point along x and its third point nearly stand on one line; choose another third"
        )
    return _frame(np.asarray(origin, float), x / lengths[0], z / np.linalg.norm(z))


@dataclass(frozen=True, slots=True, eq=False)
class GravityDirection:
    """The vertical and gravity, estimated from bodies in free flight."""

    up: Array  # (3,) unit vector, in the present world
    tilt_sd_rad: float  # of up, in its least certain direction [rad]
    magnitude: float  # [m/s^2]; 9.81 if scale and frame rate are right
    magnitude_sd: float
    n_throws: int

    def describe(self) -> str:
        """Say in one line what was estimated and whether lengths and times are consistent."""
        ratio = self.magnitude / STANDARD_GRAVITY_M_S2
        error = abs(self.magnitude - STANDARD_GRAVITY_M_S2)
        sentence = (
            f"up from {count(self.n_throws, 'throw')}: known to {np.degrees(self.tilt_sd_rad):.2f} "
            f"degrees; the fall is {self.magnitude:.2f} m/s2 (sd {self.magnitude_sd:.2f}), expected 9.81"
        )
        if error <= max(3 * self.magnitude_sd, 0.01 * STANDARD_GRAVITY_M_S2):
            return sentence
        return (
            f"{sentence}, so lengths come out as {ratio:.3f} of the truth or times as {ratio**-0.5:.3f} of it; check "
            "the length of the wand or the board, and the frame rate"
        )


def estimate_gravity(times_s: Array, throws: Sequence[Array]) -> GravityDirection:
    """Estimate gravity from bodies in free flight: parabolas with one common acceleration, fitted robustly.

    times_s (t,) [s], throws: each (t, 3) [m] in the old world, NaN where not seen or not in the air; a ball is good, of
    a tumbling body take the centre of mass. Drag is neglected. Raises CalibrationError where the flight is too short.
    """
    times_s = np.asarray(times_s, float)
    flights = [
        (times_s[is_seen], throw[is_seen]) for throw in throws if (is_seen := np.isfinite(throw).all(axis=1)).any()
    ]
    flights = [(t - t.mean(), x) for t, x in flights if len(t) >= _FEWEST_TIMES]
    longest = max((float(np.ptp(t)) for t, _ in flights), default=0.0)
    if STANDARD_GRAVITY_M_S2 * longest**2 / 8 < _SHORTEST_FALL_M:
        needed_s = np.sqrt(8 * _SHORTEST_FALL_M / STANDARD_GRAVITY_M_S2)
        raise CalibrationError(
            f"the throw is seen for {longest:.2f} s at most; {needed_s:.2f} s "
            f"and {_FEWEST_TIMES} positions are needed to tell which way is up: throw higher"
        )
    g, covariance = _common_acceleration(flights)
    magnitude = float(np.linalg.norm(g))
    up = -g / magnitude
    across = np.eye(3) - np.outer(up, up)
    tilt = float(np.sqrt(np.linalg.eigvalsh(across @ covariance @ across)[-1])) / magnitude
    return GravityDirection(up, tilt, magnitude, float(np.sqrt(up @ covariance @ up)), len(flights))


def frame_of_gravity(gravity: GravityDirection, origin: Array, along_x: Array) -> RigidTransform:
    """Return new_from_old of the world with z up, this origin, and x toward a second point (3,) [m], made level."""
    x = np.asarray(along_x - origin, float)
    level = x - (x @ gravity.up) * gravity.up
    if not np.isfinite(level).all() or np.linalg.norm(level) < _NEAREST_M:
        raise CalibrationError(
            "the world's point along x stands right above or below its origin, or was not found; choose another"
        )
    return _frame(np.asarray(origin, float), level / np.linalg.norm(level), gravity.up)


def merge_rigs(rigs: Sequence[Rig]) -> Rig:
    """Merge the initial rigs of several sources: the first rig's world stays, the others are aligned with it in turn.

    Rigs are aligned by the cameras that both hold: by one camera's pose or, if there are more, by all positions and the
    mean rotation; both must be in metres. Raises CalibrationError naming the cameras that stay unconnected.
    """
    merged = {camera.name: camera for camera in rigs[0]}
    remaining = list(rigs[1:])
    while remaining:
        next_rig = max(remaining, key=lambda rig: len(set(rig.names) & set(merged)))
        shared = [name for name in next_rig.names if name in merged]
        if not shared:
            raise CalibrationError(
                f"nothing ties {', '.join(next_rig.names)} to {', '.join(merged)}: let one camera at least take part "
                "in both sources (board, wand, court, points)"
            )
        new_from_old = _align_rig([merged[name].camera_from_world for name in shared], next_rig.select(shared))
        for camera in next_rig:
            moved = replace(camera, camera_from_world=camera.camera_from_world * new_from_old.inv())
            merged.setdefault(camera.name, moved)
        remaining.remove(next_rig)
    return Rig(tuple(merged.values()))


def _align_rig(targets: Sequence[RigidTransform], rig: Rig) -> RigidTransform:
    """Return new_from_old that aligns the rig's cameras with their target poses."""
    candidates = [target.inv() * camera.camera_from_world for target, camera in zip(targets, rig, strict=True)]
    rotation = Rotation.concatenate([candidate.rotation for candidate in candidates]).mean()
    centres = np.array([target.inv().translation for target in targets]), np.array([camera.centre for camera in rig])
    if len(rig) >= 3:  # rotations of initial values are less certain than positions far apart
        directions = [c - c.mean(axis=0) for c in centres]
        sizes = np.linalg.svd(directions[1], compute_uv=False)
        if sizes[1] > 0.1 * sizes[0]:
            rotation = Rotation.align_vectors(*directions)[0]
    shift = np.mean(centres[0] - rotation.apply(centres[1]), axis=0)
    return RigidTransform.from_components(shift, rotation)


def _frame(origin: Array, x: Array, z: Array) -> RigidTransform:
    rotation = Rotation.from_matrix(np.stack([x, np.cross(z, x), z]))
    return RigidTransform.from_components(-rotation.apply(origin), rotation)


def _common_acceleration(flights: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the acceleration (3,) of all parabolas and its covariance (3, 3), by robust least squares (Cauchy)."""
    rows, sides = [], []
    for i, (t, x) in enumerate(flights):
        own = np.zeros((len(t), 1 + 2 * len(flights)))
        own[:, 0], own[:, 1 + 2 * i], own[:, 2 + 2 * i] = t**2 / 2, 1.0, t
        rows.append(own)
        sides.append(x)
    A, b = np.concatenate(rows), np.concatenate(sides)
    start = np.linalg.lstsq(A, b, rcond=None)[0]
    distances = np.linalg.norm(b - A @ start, axis=1)
    scale = max(SD_OF_MEDIAN_DEVIATION * float(np.median(distances)), 1e-9)
    fit = least_squares(
        lambda p: ((b - A @ p.reshape(start.shape)) / scale).ravel(), start.ravel(), loss="cauchy", x_scale="jac"
    )
    p = fit.x.reshape(start.shape)
    weights = 1 / (1 + np.sum(((b - A @ p) / scale) ** 2, axis=1))
    information = A.T @ (weights[:, None] * A)
    residual = (b - A @ p) * np.sqrt(weights)[:, None]
    n_redundant = max(weights.sum() - A.shape[1], 1.0)
    return p[0], float(np.linalg.inv(information)[0, 0]) * (residual.T @ residual) / n_redundant
