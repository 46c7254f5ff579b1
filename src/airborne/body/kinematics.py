"""Forward kinematics: from joint angles to the segments of a body, of one pose or of many."""

from __future__ import annotations

import math

from airborne.kernels import kernel


@kernel(fastmath=True)
def chain_segments(parents, joints, angles, R, t):
    """Fill R and t of every segment but the root: parent's rotation times Rx Ry Rz, about the joint in the parent.

    parents (s,); joints (s, 3) [m] in the parent; angles (n, s - 1, 3) [rad]; R (n, s, 3, 3), t (n, s, 3) [m], world
    from segment, with the root's filled in.
    """
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
