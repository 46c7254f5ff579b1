"""Forward kinematics of many poses at once: joint angles to segment transforms, for searches over articulated poses."""

from __future__ import annotations

import math

import numpy as np

from airborne.body import BodyModel
from airborne.kernels import kernel
from airborne.types import Array


def pose_segments(model: BodyModel, root_R: Array, root_t: Array, joint_angles: Array) -> tuple[Array, Array]:
    """Pose the segments of n hypotheses in the world: R (n, s, 3, 3), t (n, s, 3) [m].

    root_R (n, 3, 3), root_t (n, 3) [m] world from root; joint_angles (n, s - 1, 3) [rad], successive rotations about
    the moving x, y and z axes, in the order of the segments. The same as `BodyModel.with_pose`, for a batch.
    """
    n, s = len(root_R), len(model.segments)
    R, t = np.empty((n, s, 3, 3)), np.empty((n, s, 3))
    R[:, 0], t[:, 0] = root_R, root_t
    _chain(model.parents, model.joints_m, np.ascontiguousarray(joint_angles, float), R, t)
    return R, t


@kernel(fastmath=True)
def _chain(parents, joints, angles, R, t):
    """Fill R and t of every segment but the root: parent's rotation times Rx Ry Rz, about the joint in the parent."""
    for h in range(len(R)):
        for s in range(1, len(parents)):
            p = parents[s]
            a, b, c = angles[h, s - 1, 0], angles[h, s - 1, 1], angles[h, s - 1, 2]
            ca, sa, cb, sb, cc, sc = math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c)
            for i in range(3):
                x, y, z = R[h, p, i, 0], R[h, p, i, 1], R[h, p, i, 2]
                t[h, s, i] = t[h, p, i] + x * joints[s, 0] + y * joints[s, 1] + z * joints[s, 2]
                y, z = ca * y + sa * z, ca * z - sa * y
                x, z = cb * x - sb * z, sb * x + cb * z
                R[h, s, i, 0], R[h, s, i, 1], R[h, s, i, 2] = cc * x + sc * y, cc * y - sc * x, z
