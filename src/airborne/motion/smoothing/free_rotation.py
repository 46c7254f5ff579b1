"""Rotation in free flight: angular momentum is constant, so that joints and six numbers say how a body turns.

A tracker's errors turn the pelvis to and fro by degrees, for five to eight frames each: as motion does, so that no
filter of its orientation alone can tell them. Nothing turns the whole body, though. In the root's axes
I w + h = R' L: of the joints follow its inertia I and the momentum h of their motion, so that the first orientation
and the constant momentum L are all that is left to fit. Source: Yeadon, Atha and Hales 1990, "The simulation of aerial
movement - IV", J. Biomech. 23, 85-89.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from airborne.body import BodyModel
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.motion.flight.momentum import angular_momentum
from airborne.motion.flight.momentum_table import falls_freely, has_inertias
from airborne.motion.motion import Motion
from airborne.motion.smoothing.butterworth import butterworth_smoother, is_evenly_sampled
from airborne.motion.smoothing.rotations import SmoothedRotations, smooth_rotations
from airborne.motion.smoothing.segments import finite_rows
from airborne.types import Array

# of the joints' low-pass: trunks hardly move, but are tracked to and fro against the pelvis. Chosen on synthetic
# somersaults 71 and 72, arms and pikes: with 2 Hz of all, angular velocities err by 30 to 55 % of the tracked ones,
# so by 22 to 47 %, with 2 to 4 Hz of the limbs alike
TRUNK, _TRUNK_HZ, _LIMB_HZ = ("torso", "chest", "head", "shoulder_left", "shoulder_right"), 1.0, 4.0
_TRACKED_SD_RAD = np.radians(5.0)  # of tracked orientations; further ones count less: of the same somersaults 2 to 3
_MOST_OFF = 1.5  # median distance of tracked orientations from a flight's, in these sds; the same have up to 0.8
_LONGEST_GAP_S = 0.5  # in a stretch, beyond any that may be filled
_MOMENTUM_UNIT = 10.0  # [kg m2/s] a step of the fit
_TOLERANCE = 1e-6  # of the fit: a millionth of its numbers, and of its cost


class _Masses(NamedTuple):
    """The masses of a body and their motion at n times, about the centre of mass, in the root's axes."""

    time_s: Array  # (n,)
    inertia: Array  # (n, 3, 3) [kg m2]
    momentum: Array  # (n, 3) [kg m2/s] of the joints' motion alone


def conserve_momentum(rotations: SmoothedRotations, motion: Motion, model: BodyModel) -> SmoothedRotations:
    """Let the root turn with a constant angular momentum wherever its body, jointed and with masses, falls freely.

    Standard deviations stay those of the smoothed orientations. Stretches that are sampled unevenly, or whose tracked
    orientations lie far off, stay as they are.
    """
    if not (motion.joints and has_inertias(model)):
        return rotations
    for rows in _flights(rotations, motion, model):
        masses = _mass_distribution(model, motion.time_s[rows], *_smooth_joints(motion, rows))
        flight = _fit_flight(masses, motion.R[rows])
        if flight is not None:
            names = ("R", "velocity", "acceleration")
            changed = {name: getattr(rotations, name).copy() for name in names}
            for name, values in zip(names, flight, strict=True):
                changed[name][rows] = values
            rotations = replace(rotations, **changed)
    return rotations


def _flights(rotations: SmoothedRotations, motion: Motion, model: BodyModel) -> Iterator[slice]:
    """Yield the smoothed stretches in which the centre of mass falls freely."""
    is_known = finite_rows(rotations.R.reshape(-1, 9))
    label = np.where(is_known, rotations.segment, -1)
    for rows in np.split(np.arange(len(label)), np.flatnonzero(np.diff(label)) + 1):
        posed, time_s = rows[motion.has_pose[rows]], motion.time_s[rows]
        is_even = is_evenly_sampled(time_s) and np.diff(time_s).max() < 1 / (2 * _LIMB_HZ)
        if label[rows[0]] >= 0 and is_even and falls_freely(motion, model, posed):
            yield slice(int(rows[0]), int(rows[-1]) + 1)


def _smooth_joints(motion: Motion, rows: slice) -> tuple[Array, Array]:
    """Return joint rotations (n, joints, 3, 3) and their rates (n, joints, 3) [rad/s], in the segments' axes."""
    unknown = np.full(rows.stop - rows.start, np.nan)
    joints = []
    for name, angles in zip(motion.joints, motion.joint_angles[rows].swapaxes(0, 1), strict=True):
        smooth = partial(butterworth_smoother, cutoff_hz=_TRUNK_HZ if name in TRUNK else _LIMB_HZ)
        R = matrix_from_angles(angles)
        joints.append(smooth_rotations(smooth, motion.time_s[rows], R, unknown, fill_s=_LONGEST_GAP_S))
    R = np.stack([joint.R for joint in joints], axis=1)
    return R, np.einsum("njki,njk->nji", R, np.stack([joint.velocity for joint in joints], axis=1))


def _fit_flight(masses: _Masses, tracked: Array) -> tuple[Array, Array, Array] | None:
    """Return orientations (n, 3, 3) nearest to those tracked, angular velocities and accelerations; None if far off."""
    time_s, inertia, momentum = masses
    is_tracked = finite_rows(tracked.reshape(-1, 9))

    def fly(x: Array) -> tuple[Array, Array]:
        start = Rotation.from_rotvec(x[:3]).as_matrix() @ tracked[0]
        return _integrate(start, _MOMENTUM_UNIT * x[3:], masses)

    def distances(x: Array) -> Array:
        return _vectors(fly(x)[0][is_tracked] @ tracked[is_tracked].swapaxes(1, 2)) / _TRACKED_SD_RAD

    pairs = np.flatnonzero(is_tracked[1:] & is_tracked[:-1])
    R, w = tracked[pairs], _vectors(tracked[pairs + 1] @ tracked[pairs].swapaxes(1, 2)) / np.diff(time_s)[pairs, None]
    spin = np.einsum("nij,nkj,nk->ni", inertia[pairs], R, w) + momentum[pairs]
    L = np.median(np.einsum("nij,nj->ni", R, spin), axis=0)
    x = np.concatenate([np.zeros(3), L / _MOMENTUM_UNIT])
    fit = least_squares(lambda x: distances(x).ravel(), x, loss="soft_l1", xtol=_TOLERANCE, ftol=_TOLERANCE)
    if np.median(np.linalg.norm(distances(fit.x), axis=1)) > _MOST_OFF:
        return None
    R, velocity = fly(fit.x)
    return R, velocity, np.gradient(velocity, time_s, axis=0)


def _mass_distribution(model: BodyModel, time_s: Array, joint_R: Array, rates: Array) -> _Masses:
    n, n_segments = len(joint_R), len(model.segments)
    R, _ = model.pose_segments(np.eye(3), np.zeros(3), angles_from_matrix(joint_R))
    unit = np.zeros((3, n, n_segments, 3))
    unit[range(3), :, 0, range(3)] = 1.0
    joints_alone = np.concatenate([np.zeros((n, 1, 3)), rates], axis=1)
    inertia = np.moveaxis(angular_momentum(model, R, unit), 0, -1)
    return _Masses(time_s, inertia, angular_momentum(model, R, joints_alone))


def _integrate(start: Array, L: Array, masses: _Masses) -> tuple[Array, Array]:
    """Turn a body from its first orientation, by Runge and Kutta: R (n, 3, 3), angular velocities (n, 3), world axes.

    Between frames, inertia and momentum are interpolated.
    """
    time_s, inertia, momentum = masses
    inverse = np.linalg.inv(inertia)
    half_inverse, half = np.linalg.inv((inertia[1:] + inertia[:-1]) / 2), (momentum[1:] + momentum[:-1]) / 2

    def spin(R: Array, inverse: Array, h: Array) -> Array:
        return R @ inverse @ (R.T @ L - h)

    def rate(R: Array, inverse: Array, h: Array) -> Array:
        x, y, z = spin(R, inverse, h)
        return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ R

    R = np.empty((len(time_s), 3, 3))
    R[0] = start
    for i, dt_s in enumerate(np.diff(time_s)):
        first = rate(R[i], inverse[i], momentum[i])
        second = rate(R[i] + dt_s / 2 * first, half_inverse[i], half[i])
        third = rate(R[i] + dt_s / 2 * second, half_inverse[i], half[i])
        last = rate(R[i] + dt_s * third, inverse[i + 1], momentum[i + 1])
        R[i + 1] = R[i] + dt_s / 6 * (first + 2 * second + 2 * third + last)
    R = Rotation.from_matrix(R).as_matrix()
    return R, np.array([spin(*each) for each in zip(R, inverse, momentum, strict=True)])


def _vectors(R: Array) -> Array:
    """Return the rotation vectors (n, 3) [rad] of rotations (n, 3, 3)."""
    return Rotation.from_matrix(R).as_rotvec()
