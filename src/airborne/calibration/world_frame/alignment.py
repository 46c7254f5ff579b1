"""Where the world is: frames by three points or by a thrown body's fall, and starts of several sources joined.

A frame is given as `new_from_old`, the rigid map from the world that the cameras stand in to the one that is wanted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras.camera import Rig
from airborne.errors import CalibrationError
from airborne.geometry.robust import SD_OF_MEDIAN_DEVIATION
from airborne.types import Array

_STANDARD_GRAVITY = 9.80665  # [m/s^2]
_NEAREST_M = 0.05  # points that are to fix an axis stand further apart than this
_LEAST_ANGLE = np.radians(5)  # between the axis and the third point
_FEWEST_TIMES = 6  # of a throw
_SHORTEST_FALL_M = 0.1  # a throw whose path is bent less says little about down


def frame_of_three_points(origin: Array, along_x: Array, in_xy: Array) -> RigidTransform:
    """Return new_from_old of the world with this origin, x toward the second point and the third on the side of y > 0.

    Points (3,) in the old world [m]; z = x cross y. Raises CalibrationError where they nearly stand on one line.
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
class Gravity:
    """Up, as a flying body tells it."""

    up: Array  # (3,) unit vector, in the world that the body was seen in
    tilt_sd_rad: float  # of up, in the direction in which it is known least [rad]
    magnitude: float  # [m/s^2]; 9.81 where the scale and the frame rate are right
    magnitude_sd: float
    n_throws: int

    def describe(self) -> str:
        """Say in one line what was found and whether length and time fit together."""
        ratio = self.magnitude / _STANDARD_GRAVITY
        off = abs(self.magnitude - _STANDARD_GRAVITY)
        said = (
            f"up from {self.n_throws} throw{'s' * (self.n_throws > 1)}: known to {np.degrees(self.tilt_sd_rad):.2f} "
            f"degrees; the fall is {self.magnitude:.2f} m/s2 (sd {self.magnitude_sd:.2f}), expected 9.81"
        )
        if off <= max(3 * self.magnitude_sd, 0.01 * _STANDARD_GRAVITY):
            return said
        return (
            f"{said}, so lengths come out as {ratio:.3f} of the truth or times as {ratio**-0.5:.3f} of it; check the "
            "length of the wand or the board, and the frame rate"
        )


def estimate_gravity(times_s: Array, throws: Sequence[Array]) -> Gravity:
    """Find up from bodies in free flight: parabolas with one common acceleration, fitted robustly.

    times_s (t,) [s], throws: each (t, 3) [m] in the old world, NaN where not seen or not in the air; a ball is good, of
    a tumbling body take the centre of mass. Air is neglected. Raises CalibrationError where they fly too little.
    """
    times_s = np.asarray(times_s, float)
    flights = [(times_s[seen], throw[seen]) for throw in throws if (seen := np.isfinite(throw).all(axis=1)).any()]
    flights = [(t - t.mean(), x) for t, x in flights if len(t) >= _FEWEST_TIMES]
    longest = max((float(np.ptp(t)) for t, _ in flights), default=0.0)
    if _STANDARD_GRAVITY * longest**2 / 8 < _SHORTEST_FALL_M:
        raise CalibrationError(
            f"the throw is seen for {longest:.2f} s at most; {np.sqrt(8 * _SHORTEST_FALL_M / _STANDARD_GRAVITY):.2f} s "
            f"and {_FEWEST_TIMES} places are needed to tell which way is up: throw higher"
        )
    g, covariance = _common_acceleration(flights)
    magnitude = float(np.linalg.norm(g))
    up = -g / magnitude
    across = np.eye(3) - np.outer(up, up)
    tilt = float(np.sqrt(np.linalg.eigvalsh(across @ covariance @ across)[-1])) / magnitude
    return Gravity(up, tilt, magnitude, float(np.sqrt(up @ covariance @ up)), len(flights))


def frame_of_gravity(gravity: Gravity, origin: Array, along_x: Array) -> RigidTransform:
    """Return new_from_old of the world with z up, this origin, and x toward a second point (3,) [m] seen from above."""
    x = np.asarray(along_x - origin, float)
    level = x - (x @ gravity.up) * gravity.up
    if not np.isfinite(level).all() or np.linalg.norm(level) < _NEAREST_M:
        raise CalibrationError(
            "the world's point along x stands right above or below its origin, or was not found; choose another"
        )
    return _frame(np.asarray(origin, float), level / np.linalg.norm(level), gravity.up)


def merge_rigs(rigs: Sequence[Rig]) -> Rig:
    """Join starts that different sources gave: the first rig's world stays, the others are moved onto it, one by one.

    Two rigs join through cameras that both hold: by one camera's place and direction or, where there are more, by the
    places of all and the mean direction; both must be in metres. Raises CalibrationError naming the cameras that stay
    apart.
    """
    known = {camera.name: camera for camera in rigs[0]}
    waiting = list(rigs[1:])
    while waiting:
        most = max(waiting, key=lambda rig: len(set(rig.names) & set(known)))
        shared = [name for name in most.names if name in known]
        if not shared:
            raise CalibrationError(
                f"nothing ties {', '.join(most.names)} to {', '.join(known)}: let one camera at least take part in "
                "both sources (board, wand, court, points)"
            )
        new_from_old = _align_rig([known[name].camera_from_world for name in shared], most.select(shared))
        for camera in most:
            moved = replace(camera, camera_from_world=camera.camera_from_world * new_from_old.inv())
            known.setdefault(camera.name, moved)
        waiting.remove(most)
    return Rig(tuple(known.values()))


def _align_rig(wanted: Sequence[RigidTransform], rig: Rig) -> RigidTransform:
    """Return new_from_old that brings the rig's cameras to where they are wanted."""
    answers = [place.inv() * camera.camera_from_world for place, camera in zip(wanted, rig, strict=True)]
    turn = Rotation.concatenate([answer.rotation for answer in answers]).mean()
    centres = np.array([place.inv().translation for place in wanted]), np.array([camera.centre for camera in rig])
    if len(rig) >= 3:  # directions of starts are worse known than places far apart
        directions = [c - c.mean(axis=0) for c in centres]
        sizes = np.linalg.svd(directions[1], compute_uv=False)
        if sizes[1] > 0.1 * sizes[0]:
            turn = Rotation.align_vectors(*directions)[0]
    shift = np.mean(centres[0] - turn.apply(centres[1]), axis=0)
    return RigidTransform.from_components(shift, turn)


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
    off = np.linalg.norm(b - A @ start, axis=1)
    scale = max(SD_OF_MEDIAN_DEVIATION * float(np.median(off)), 1e-9)
    fit = least_squares(
        lambda p: ((b - A @ p.reshape(start.shape)) / scale).ravel(), start.ravel(), loss="cauchy", x_scale="jac"
    )
    p = fit.x.reshape(start.shape)
    weights = 1 / (1 + np.sum(((b - A @ p) / scale) ** 2, axis=1))
    information = A.T @ (weights[:, None] * A)
    residual = (b - A @ p) * np.sqrt(weights)[:, None]
    spare = max(weights.sum() - A.shape[1], 1.0)
    return p[0], float(np.linalg.inv(information)[0, 0]) * (residual.T @ residual) / spare
