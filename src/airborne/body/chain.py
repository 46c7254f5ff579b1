"""The kinematic chain: changes of a pose, and the Jacobians of a body's points and segments.

A change of a pose, `delta` (6 + 3 joints,), is the root's translation [m] and rotation vector [rad], both in world
axes, then for the joint of every segment after the root a rotation vector [rad] in that segment's own axes. Covariances
of poses are over the same numbers in the same order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.body.model import BodyModel, Pose, PosedBody
from airborne.geometry.joint_rotations import compose_rotation_vectors, motion_between, rotation_vectors_between
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.kernels import kernel
from airborne.types import Array

_LOCKED = 1e-8  # cosine of the middle angle below which the other two are one angle


def chain_of(model: BodyModel, index: int) -> list[int]:
    """Return a segment's ancestors, the root first, and itself."""
    return [index] if index == 0 else [*chain_of(model, int(model.parents[index])), index]


def subtree(model: BodyModel, index: int) -> list[int]:
    """Return a segment and its descendants."""
    return [i for i in range(len(model.segments)) if index in chain_of(model, i)]


def move_pose(pose: Pose, delta: Array) -> Pose:
    """Apply a change `delta` (6 + 3 joints,) to a pose.

    The root is translated, and rotated about its own origin; a joint's parent_from_segment is followed by the
    rotation in the segment's axes. The new joint angles lie on the branch nearest to the old ones.
    """
    root = pose.move(delta[:3], delta[3:6])
    n_joints = (len(delta) - 6) // 3
    if not n_joints:
        return root
    return replace(
        root, joint_angles=compose_rotation_vectors(angles_of(pose, n_joints), np.reshape(delta[6:], (n_joints, 3)))
    )


def delta_between(earlier: Pose, later: Pose) -> Array:
    """Return the change (6 + 3 joints,) from one pose to another: the inverse of `move_pose`."""
    root = motion_between(earlier.world_from_root.as_matrix(), later.world_from_root.as_matrix())
    n_joints = max(len(earlier.joint_angles), len(later.joint_angles))
    if not n_joints:
        return root
    rotations = rotation_vectors_between(angles_of(earlier, n_joints), angles_of(later, n_joints))
    return np.concatenate([root, rotations.ravel()])


def clamp_to_limits(model: BodyModel, pose: Pose) -> Pose:
    """Return the pose with every joint clamped to its limits; joints within are left as they are, bit for bit."""
    return replace(pose, joint_angles=clamp_angles(model, pose.joint_angles)) if pose.joint_angles.size else pose


def clamp_angles(model: BodyModel, angles: Array) -> Array:
    """Return joint angles (..., joints, 3) [rad] within the joints' limits; those within are left as they are."""
    R = matrix_from_angles(angles)
    clamped = model.limits.clamp(R)
    is_out = np.any(clamped != R, axis=(-2, -1))
    return np.where(is_out[..., None], angles_near(clamped, angles), angles)


def joint_angles_of(model: BodyModel, R: Array, near: Array | None = None) -> Array:
    """Read the joint angles (..., joints, 3) [rad] off the rotations, world from segment, (..., segments, 3, 3).

    `near` (..., joints, 3) are angles that fix the branch; without it y lies in [-pi/2, pi/2].
    """
    parent_from_segment = np.swapaxes(R[..., model.parents[1:], :, :], -1, -2) @ R[..., 1:, :, :]
    return angles_from_matrix(parent_from_segment) if near is None else angles_near(parent_from_segment, near)


def nearest_angles(angles: Array, near: Array) -> Array:
    """Return, of all x-y-z angles (..., 3) [rad] of the same rotation, those nearest to `near` (..., 3).

    (x, y, z) and (x + pi, pi - y, z + pi) are the same rotation, and so are angles 2 pi apart. NaN stays NaN.
    """
    angles = np.asarray(angles, float)
    other = np.stack([angles[..., 0] + np.pi, np.pi - angles[..., 1], angles[..., 2] + np.pi], axis=-1)
    both = np.stack([angles, other])
    both = both + 2 * np.pi * np.round((near - both) / (2 * np.pi))
    distance = np.sum((both - near) ** 2, axis=-1)
    return np.where((distance[1] < distance[0])[..., None], both[1], both[0])


def segment_jacobians(posed: PosedBody, origin: Array) -> Array:
    """Differentiate every segment's rigid motion by the pose: (segments, 6, 6 + 3 joints).

    Rows are the translation of that point of the segment which is now at `origin` (3,) world [m], and the segment's
    rotation vector [rad], both in world axes.
    """
    return _segment_jacobians(posed.model.parents, posed.R, posed.t, np.asarray(origin, float))


@kernel
def _segment_jacobians(parents, R, t, origin):
    n = len(R)
    jacobian = np.zeros((n, 6, 3 + 3 * n))
    for segment in range(n):
        _point_columns(parents, R, t, segment, origin, jacobian[segment])
        joint = segment
        while True:  # from the segment to the root, which rotates about the world's axes
            for a in range(3):
                for b in range(3):
                    jacobian[segment, 3 + b, 3 + 3 * joint + a] = R[joint, b, a] if joint else 1.0 * (a == b)
            if joint == 0:
                break
            joint = parents[joint]
    return jacobian


@kernel(is_inner=True)
def _point_columns(parents, R, t, segment, point, jacobian):
    """Write a point's derivatives by the root and by the joints of a segment and its ancestors; the others stay."""
    joint = segment
    while True:
        x, y, z = point[0] - t[joint, 0], point[1] - t[joint, 1], point[2] - t[joint, 2]
        for a in range(3):
            column = 3 + 3 * joint + a
            i, j, k = R[joint, 0, a], R[joint, 1, a], R[joint, 2, a]
            if joint == 0:
                i, j, k = 1.0 * (a == 0), 1.0 * (a == 1), 1.0 * (a == 2)
            jacobian[0, column] = j * z - k * y
            jacobian[1, column] = k * x - i * z
            jacobian[2, column] = i * y - j * x
        if joint == 0:
            break
        joint = parents[joint]
    for a in range(3):
        jacobian[a, a] = 1.0


def point_jacobian(posed: PosedBody, segment: int | NDArray[np.integer], points: Array) -> Array:
    """Differentiate world points (..., 3) [m], fixed in `segment` (...), by the pose: (..., 3, 6 + 3 joints).

    The root gives I and w x (p - t_root), the joint of an ancestor k, or of the segment itself, a x (p - t_k) for each
    axis a of segment k; other joints give 0. `segment` holds indices, one for all points or one each.
    """
    points = np.asarray(points, float)
    shape = np.broadcast_shapes(np.shape(segment), points.shape[:-1])
    owners = np.array(np.broadcast_to(segment, shape), np.int64).ravel()
    flat = np.array(np.broadcast_to(points, (*shape, 3))).reshape(-1, 3)
    jacobian = _point_jacobians(posed.model.parents, posed.R, posed.t, owners, flat)
    return jacobian.reshape(*shape, *jacobian.shape[1:])


@kernel
def _point_jacobians(parents, R, t, segments, points):
    jacobian = np.zeros((len(points), 3, 3 + 3 * len(R)))
    for row in range(len(points)):
        _point_columns(parents, R, t, segments[row], points[row], jacobian[row])
    return jacobian


def separation_rows(posed: PosedBody, segments: NDArray[np.integer], points: Array, directions: Array) -> Array:
    """Differentiate how far a point of one segment gets from the same point of another: (k, 6 + 3 joints).

    segments (k, 2) of the two, points (k, 3) world [m]; the distance is along directions (k, 3), of the first segment's
    point less the other's. Joints above both, as the root, move both alike: their columns are zero.
    """
    return _separation_rows(posed.model.parents, posed.R, posed.t, segments, points, directions)


@kernel
def _separation_rows(parents, R, t, segments, points, directions):
    rows = np.zeros((len(points), 3 + 3 * len(R)))
    for k in range(len(points)):
        point, d = points[k], directions[k]
        for side in range(2):
            sign, joint = 1.0 - 2.0 * side, segments[k, side]
            while joint:
                x, y, z = point[0] - t[joint, 0], point[1] - t[joint, 1], point[2] - t[joint, 2]
                p, q, r = y * d[2] - z * d[1], z * d[0] - x * d[2], x * d[1] - y * d[0]  # a x (point - t) . d, by a
                for a in range(3):
                    turn = R[joint, 0, a] * p + R[joint, 1, a] * q + R[joint, 2, a] * r
                    rows[k, 3 + 3 * joint + a] += sign * turn
                joint = parents[joint]
    return rows


def angles_of(pose: Pose, n_joints: int) -> Array:
    """Return the joint angles (joints, 3) of a pose, where an empty array stands for straight joints."""
    return np.asarray(pose.joint_angles, float) if pose.joint_angles.size else np.zeros((n_joints, 3))


def angles_near(matrix: Array, near: Array) -> Array:
    """Read x-y-z angles off matrices on the branch nearest to `near`; where y is +-90 degrees, x stays as it was."""
    angles = angles_from_matrix(matrix)
    x = np.where(np.hypot(matrix[..., 1, 2], matrix[..., 2, 2]) < _LOCKED, near[..., 0], angles[..., 0])
    c, s = np.cos(x), np.sin(x)
    z = np.arctan2(c * matrix[..., 1, 0] + s * matrix[..., 2, 0], c * matrix[..., 1, 1] + s * matrix[..., 2, 1])
    return nearest_angles(np.stack([x, angles[..., 1], z], axis=-1), near)
