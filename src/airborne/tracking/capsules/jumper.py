"""The body of the `blocker` method: trunk and legs as a chain with constant lengths, drawn as tapered capsules.

Eighteen numbers are a pose: the middle of the hips (3) [m]; the pelvis' heading, side lean and forward lean [rad],
R = Rz(heading) Ry(side) Rx(lean); the trunk's bend forward and sideways; for the left leg, then the right, the hip's
x, y, z, the knee's and the ankle's flexion. Axes and signs are those of `human`: x to the subject's left, y backward.
"""

from __future__ import annotations

import numpy as np

from airborne.body.legs import LEG_POINTS
from airborne.kernels import kernel

N_DOF = 18  # degrees of freedom: position (3), rotation and trunk (5), legs (2 x 5)
JOINTS = (*LEG_POINTS, "foot_left", "foot_right", "torso")
SHIRT, SHORTS, SKIN, SOCK, SHOE = range(5)  # surface classes
SURFACE_CLASSES = ("shirt", "shorts", "skin", "socks", "shoes")
# columns of the lengths
WAIST, SHORTS_END, SOCK_END, TRUNK, PELVIS, THIGH, SHANK, FOOT, SOLE = range(9)
# columns of the radii
R_CHEST, R_WAIST, R_HIP, R_KNEE, R_ANKLE, R_FOOT, CHEST_OUT, HIP_OUT = range(8)
_HEEL = 0.35  # heel behind the ankle, over the ball of the foot before it
FOOT_HEIGHT_M = 0.03  # of the ball of the foot over the floor in standing
_MEAN_REACH = np.pi / 4  # of a half disc below its middle, over its radius
_TOE = 1.25  # toes before the ankle, likewise
_ANYWHERE = (-np.inf, np.inf)
_LEG_LIMITS_DEG = ((-125, 35), (-45, 25), (-40, 60), (0, 145), (-35, 50))  # hip x, y, z, knee, ankle, of the left leg
LIMITS_RAD = np.radians(  # (18, 2) least and greatest; the right leg mirrors y and z
    [_ANYWHERE] * 4
    + [(-35, 35), (-35, 75), (-25, 70), (-25, 25)]
    + list(_LEG_LIMITS_DEG)
    + [tuple(-x for x in limits[::-1]) if i in (1, 2) else limits for i, limits in enumerate(_LEG_LIMITS_DEG)]
)


# the two surface classes and the leg (0 trunk, 1 left, 2 right) of each capsule
CAPSULES = np.array(
    [(SHIRT, SHIRT, 0), (SHIRT, SHIRT, 0), (SHORTS, SHIRT, 0), (SHORTS, SHIRT, 0)]
    + [(a, b, leg) for leg in (1, 2) for a, b in ((SHORTS, SKIN), (SKIN, SOCK), (SHOE, SHOE))],
    np.int64,
)


@kernel
def _rotate(R, axis, angle, out):
    """Fill out (3, 3) with R times a rotation about one of its axes."""
    c, s = np.cos(angle), np.sin(angle)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    for i in range(3):
        a, b = R[i, j], R[i, k]
        out[i, axis] = R[i, axis]
        out[i, j], out[i, k] = c * a + s * b, c * b - s * a


@kernel
def pose_capsules(pose, lengths, radii, points, ends, end_radii):
    """Pose a jumper: pose (18,), lengths (9,), radii (8,) [m].

    Fills points (9, 3), the JOINTS, and the capsules' ends (10, 2, 3) and radii (10, 2), all world [m].
    """
    R, Q = np.zeros((3, 3)), np.empty((3, 3))
    R[0, 0] = R[1, 1] = R[2, 2] = 1
    _rotate(R, 2, pose[3], Q)
    _rotate(Q, 1, pose[4], R)
    pelvis, trunk = np.empty((3, 3)), np.empty((3, 3))
    _rotate(R, 0, pose[5], pelvis)
    _rotate(pelvis, 0, pose[6], R)
    _rotate(R, 1, pose[7], trunk)
    for i in range(3):
        middle = pose[i]
        waist = middle + lengths[WAIST] * pelvis[i, 2]
        chest = waist + lengths[TRUNK] * trunk[i, 2]
        points[8, i] = 0.5 * (middle + chest)
        for side in range(2):
            sign = 1.0 - 2.0 * side
            points[side, i] = middle + sign * lengths[PELVIS] * pelvis[i, 0]
            ends[side, 0, i] = waist + sign * radii[HIP_OUT] * trunk[i, 0]
            ends[side, 1, i] = chest + sign * radii[CHEST_OUT] * trunk[i, 0]
            ends[2 + side, 0, i] = middle + sign * radii[HIP_OUT] * pelvis[i, 0]
            ends[2 + side, 1, i] = waist + sign * radii[HIP_OUT] * pelvis[i, 0]
    for side in range(2):
        end_radii[side, 0], end_radii[side, 1] = radii[R_WAIST], radii[R_CHEST]
        end_radii[2 + side, 0], end_radii[2 + side, 1] = radii[R_HIP], radii[R_WAIST]
        _pose_leg(pose, lengths, radii, side, pelvis, points, ends, end_radii)


@kernel(is_inner=True)
def _pose_leg(pose, lengths, radii, side, pelvis, points, ends, end_radii):
    first, c = 8 + 5 * side, 4 + 3 * side
    R, thigh, shank = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    _rotate(pelvis, 0, pose[first], thigh)
    _rotate(thigh, 1, pose[first + 1], R)
    _rotate(R, 2, pose[first + 2], thigh)
    _rotate(thigh, 0, pose[first + 3], shank)
    _rotate(shank, 0, pose[first + 4], R)
    for i in range(3):
        hip = points[side, i]
        knee = hip - lengths[THIGH] * thigh[i, 2]
        ankle = knee - lengths[SHANK] * shank[i, 2]
        sole = ankle - lengths[SOLE] * R[i, 2]
        points[2 + side, i], points[4 + side, i], points[6 + side, i] = knee, ankle, sole - lengths[FOOT] * R[i, 1]
        ends[c, 0, i], ends[c, 1, i] = hip, knee
        ends[c + 1, 0, i], ends[c + 1, 1, i] = knee, ankle
        lift = (radii[R_FOOT] - FOOT_HEIGHT_M) * R[i, 2]
        ends[c + 2, 0, i] = sole + _HEEL * lengths[FOOT] * R[i, 1] + lift
        ends[c + 2, 1, i] = sole - _TOE * lengths[FOOT] * R[i, 1] + lift
    end_radii[c, 0], end_radii[c, 1] = radii[R_HIP], radii[R_KNEE]
    end_radii[c + 1, 0], end_radii[c + 1, 1] = radii[R_KNEE], radii[R_ANKLE]
    end_radii[c + 2, 0] = end_radii[c + 2, 1] = radii[R_FOOT]


@kernel
def border_shares(lengths, radii, out):
    """Fill out (10,) with how far along its axis the first class of each capsule reaches.

    Shorts reach up to the mean lower end of the trunk's hemisphere: then the border does not move as pelvis or trunk
    becomes the nearer one to a camera in leaning over.
    """
    out[:] = 1
    for side in range(2):
        out[2 + side] = 1 - _MEAN_REACH * radii[R_WAIST] / max(lengths[WAIST], 0.01)
        out[4 + 3 * side], out[5 + 3 * side] = lengths[SHORTS_END], 1 - lengths[SOCK_END]
