"""Joint angles in the sequences that the ISB recommends.

Source: Wu et al. 2002 (J. Biomech. 35, 543-548) for trunk, hip and ankle, 2005 (J. Biomech. 38, 981-992) for shoulder,
elbow and wrist; the knee as Grood and Suntay 1983.

ISB axes: X forward, Y up, Z to the right; every angle is right-handed about its axis. The left side is mirrored, so
that its angles have the meaning of the right side's.
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.geometry.axis_sequences import angles_from_rotation, continue_angles, is_singular, sequence_angles
from airborne.geometry.rotations import matrix_from_angles
from airborne.motion.joints import OPEN_SD_RAD, require_body
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import propagate_variances, standard_deviation
from airborne.types import Array

if TYPE_CHECKING:
    import xarray as xr

_X, _Y, _Z = np.array([0.0, -1, 0]), np.array([0.0, 0, 1]), np.array([-1.0, 0, 0])  # ISB's axes in those of the body
_WRIST_X, _WRIST_Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])  # palms toward the thighs
_PRONATED_RAD = np.pi / 2  # the model's zero pose has its palms toward the thighs, the ISB's forward
_MIRRORED = np.array([1.0, -1.0, -1.0])  # a rotation vector seen in a mirror of the median plane


class _Sequence(NamedTuple):
    """How one joint's rotation is told."""

    name: str
    axes: Array  # (3, 3) rows, in the body's axes
    third_at_zero_rad: float = 0.0  # the third angle in the model's zero pose


_CARDAN = _Sequence("ZXY", np.stack([_Z, _X, _Y]))
_OF_RIGHT = {
    **dict.fromkeys(("thigh", "shank", "foot"), _CARDAN),
    "shoulder": _Sequence("YXZ", np.stack([_Y, _X, _Z])),
    "upper_arm": _Sequence("YXY", np.stack([_Y, _X, _Y])),
    "forearm": _CARDAN._replace(third_at_zero_rad=_PRONATED_RAD),
    "hand": _Sequence("ZXY", np.stack([_WRIST_Z, _WRIST_X, _Y])),
}
_OF_SEGMENT = (
    dict.fromkeys(("torso", "chest", "head"), _CARDAN)
    | {f"{name}_right": sequence for name, sequence in _OF_RIGHT.items()}
    | {f"{name}_left": sequence._replace(axes=sequence.axes * _MIRRORED) for name, sequence in _OF_RIGHT.items()}
)
_GIRDLE, _UPPER_ARM = "shoulder", "upper_arm"  # an upper arm's angles are those against the thorax


def isb_angles(motion: Motion, model: BodyModel) -> xr.Dataset:
    """Compute the joint angles [deg] in ISB's sequences, continuous over time, with standard deviations.

    Of the segments of `human18`; of others NaN, and no sequence. An upper arm's are those against the thorax. Standard
    deviations and singular frames as of `joint_angles`. Raises ResultError for another body's motion.
    """
    import xarray as xr

    require_body(motion, model)
    angles, variance = np.full((2, len(motion), len(motion.joints), 3), np.nan)
    singular, names = np.zeros(angles.shape[:2], bool), [""] * len(motion.joints)
    R = matrix_from_angles(motion.joint_angles)
    for joint, segment in enumerate(motion.joints):
        sequence = _OF_SEGMENT.get(segment)
        if sequence is None:
            continue
        names[joint], axes = sequence.name, sequence.axes
        path = _joints_between(model, joint)
        angles[:, joint] = continue_angles(sequence_angles(_rotation_along(R, path), axes), axes)
        singular[:, joint] = is_singular(angles[:, joint], axes)
        columns, jacobian = _gradient(angles[:, joint], axes, R[:, joint], path)
        for row in np.flatnonzero(motion.has_pose):
            covariance = motion.covariance[row][np.ix_(6 + columns, 6 + columns)]
            variance[row, joint] = propagate_variances(jacobian[row], covariance)
        angles[:, joint, 2] += sequence.third_at_zero_rad
    variance[variance > OPEN_SD_RAD**2] = np.inf
    sd, by_frame = standard_deviation(variance), motion.by_frame
    dimensions = ("time", "joint", "rotation")
    variables = {
        "isb_angle": (dimensions, np.rad2deg(angles), {"units": "deg", "order": "as isb_sequence, body-fixed"}),
        "isb_angle_sd": (dimensions, np.rad2deg(sd), {"units": "deg"}),
        "isb_angle_sd_frame": (dimensions, np.rad2deg(sd if by_frame is None else by_frame.isb_rad), {"units": "deg"}),
        "isb_is_singular": (dimensions[:2], singular),
        "isb_sequence": (dimensions[1:2], np.array(names)),
    }
    coordinates = {
        "time": ("time", motion.time_s, {"units": "s"}),
        "joint": np.array(motion.joints, np.str_),
        "rotation": [1, 2, 3],
    }
    return xr.Dataset(variables, coordinates)


def isb_gradients(model: BodyModel, joint_angles: Array) -> list[tuple[NDArray[np.int64], Array]]:
    """Differentiate the angles of each joint by the rotation vectors of joints in their segments' axes.

    joint_angles (n, joints, 3) x-y-z [rad]. Of each joint the columns (c,) of (3 joints,) and (n, 3, c), NaN without a
    sequence, up to the sign.
    """
    R, gradients = matrix_from_angles(joint_angles), []
    for joint, segment in enumerate(model.segments[1:]):
        sequence, path = _OF_SEGMENT.get(segment.name), _joints_between(model, joint)
        if sequence is None:
            gradients.append((3 * joint + np.arange(3), np.full((len(R), 3, 3), np.nan)))
            continue
        angles = sequence_angles(_rotation_along(R, path), sequence.axes)
        gradients.append(_gradient(angles, sequence.axes, R[:, joint], path))
    return gradients


def _rotation_along(R: Array, path: list[int]) -> Array:
    """Return the rotations (n, 3, 3) of a path of joints, of those of all joints (n, joints, 3, 3)."""
    return reduce(np.matmul, (R[:, joint] for joint in path))


def _gradient(angles: Array, axes: Array, R: Array, path: list[int]) -> tuple[NDArray[np.int64], Array]:
    """Return the columns (c,) of a path's joints, and the derivatives (n, 3, c) of its angles (n, 3) by them."""
    own = angles_from_rotation(angles, axes)
    jacobian = np.concatenate([own @ np.swapaxes(R, -1, -2), own][-len(path) :], axis=-1)
    return np.concatenate([np.arange(3 * k, 3 * k + 3) for k in path]), jacobian


def _joints_between(model: BodyModel, joint: int) -> list[int]:
    """Return the joints from the segment that a joint's angles are told against to its own, proximal first."""
    name, parent = model.segments[joint + 1].name, int(model.parents[joint + 1])
    is_arm = name.startswith(_UPPER_ARM) and model.segments[parent].name.startswith(_GIRDLE)
    return [parent - 1, joint] if is_arm else [joint]
