"""Centre of mass and angular momentum of a jointed body, with their uncertainty.

Angular velocities come from a parabola fitted to each joint's rotations over a few frames. Rotations suffice: a
translation of the whole body does not change the angular momentum about its centre of mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.body import BodyModel, PosedBody
from airborne.body.chain import point_jacobian
from airborne.body.sides import without_side
from airborne.geometry.rotations import matrix_from_angles
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import propagate_variances
from airborne.types import Array

WINDOW = 5  # frames per fitted parabola: less noise than two, and no lag
# sd of a segment's inertia, as a share: the standard error of moments of inertia of limbs that regressions on measured
# lengths and girths give (Yeadon and Morlock 1989, Journal of Biomechanics 22, 683-689)
INERTIA_SD = 0.13
_UNOBSERVED_ROTATION_SD_RAD = 2 * np.pi / np.sqrt(12)  # standard deviation of an angle uniform over the circle
_LARGEST_ROTATION_RAD = 2.0  # frames rotated further from the middle one are left out of a fit
_STEP_RAD = 1e-5  # of the central difference
_SAME_PERIOD = 1.5  # times more than so many periods apart are a gap


def centre_of_mass(posed: PosedBody) -> tuple[Array, Array]:
    """Return the centre of mass (3,) world [m], and its Jacobian (3, 6 + 3 joints) by the twist vector."""
    inertias = [segment.inertia for segment in posed.model.segments if segment.inertia is not None]
    mass = np.array([inertia.mass_kg for inertia in inertias])
    local = np.array([inertia.centre_m for inertia in inertias])
    centres = np.einsum("sij,sj->si", posed.R, local) + posed.t
    jacobian = point_jacobian(posed, np.arange(len(mass)), centres)
    return mass @ centres / mass.sum(), np.asarray(np.tensordot(mass / mass.sum(), jacobian, axes=1), float)


def angular_momentum(model: BodyModel, R: Array, rates: Array) -> Array:
    """Return the angular momentum (..., 3) [kg m^2/s] about the centre of mass, world axes.

    R (..., segments, 3, 3) is world from segment; rates (..., segments, 3) [rad/s] are angular velocities in each
    segment's own axes: of the root relative to the world, of the others relative to their parents.
    """
    return np.sum(_segment_momenta(model, R, rates), axis=-2)


def _segment_momenta(model: BodyModel, R: Array, rates: Array) -> Array:
    """Return what each segment adds to `angular_momentum`: (..., segments, 3) [kg m^2/s]."""
    shape = np.broadcast_shapes(R.shape[:-3], rates.shape[:-2])
    omega = np.empty((*shape, len(model.segments), 3))
    position, velocity = np.zeros_like(omega), np.zeros_like(omega)  # of the origins, relative to the root's
    own = np.einsum("...sij,...sj->...si", R, rates)
    omega[..., 0, :] = own[..., 0, :]
    for k, parent in enumerate(model.parents[1:], start=1):
        arm = R[..., parent, :, :] @ model.segments[k].joint_m
        omega[..., k, :] = omega[..., parent, :] + own[..., k, :]
        position[..., k, :] = position[..., parent, :] + arm
        velocity[..., k, :] = velocity[..., parent, :] + np.cross(omega[..., parent, :], arm)
    inertias = [segment.inertia for segment in model.segments if segment.inertia is not None]
    mass = np.array([inertia.mass_kg for inertia in inertias])[:, None]
    arm = np.einsum("...sij,sj->...si", R, np.array([inertia.centre_m for inertia in inertias]))
    position, velocity = position + arm, velocity + np.cross(omega, arm)
    share = mass / mass.sum()
    position, velocity = (each - np.sum(share * each, axis=-2, keepdims=True) for each in (position, velocity))
    tensor = np.array([inertia.tensor_kg_m2 for inertia in inertias])
    spin = np.einsum("...sij,sjk,...slk,...sl->...si", R, tensor, R, omega, optimize=True)
    return spin + mass * np.cross(position, velocity)


def angular_momenta(
    motion: Motion, model: BodyModel, window: int = WINDOW, *, inertia_sd: float = INERTIA_SD
) -> tuple[Array, Array]:
    """Return the angular momentum about the centre of mass (n, 3) [kg m^2/s], world axes, and its variances (n, 3).

    Angular velocities at a frame are the slopes, at its time, of parabolas through the rotations of the `window`
    nearest frames of the same unbroken stretch, shifted inward near its ends (two frames: a line; one: NaN). Lost
    frames, missing times and rotations over 2 rad end a fit. The variances are of first order in the poses of all
    frames of the fit. How much of each rotation's variance differs from frame to frame is told by its distances from
    the parabolas; the rest of the error is the same in all frames of a fit. Those of a body with joints include the
    inertias', of an sd of this share.
    """
    rotations = np.concatenate([motion.R[:, None], matrix_from_angles(motion.joint_angles)], axis=1)
    fits = {
        int(row): fit
        for stretch in _stretches(motion)
        for row in stretch
        if (fit := _angular_velocities(rotations, motion.time_s, row, _window(stretch, row, window))) is not None
    }
    covariance = np.array([_rotation_covariance(*each) for each in zip(motion.covariance, motion.R, strict=True)])
    shares = _independent_shares(list(fits.values()), covariance)
    value, variance = np.full((2, len(motion), 3), np.nan)
    by_inertia = inertia_sd * _inertia_kinds(model)
    for row, fit in fits.items():
        R = model.with_pose(motion.pose(row)).R
        parts = _segment_momenta(model, R, fit.value)
        value[row] = parts.sum(axis=0)
        if np.isnan(covariance[fit.rows]).all(axis=(1, 2)).any():
            continue  # a frame without any covariance
        gradients = dict(_gradients(model, R, fit, row))
        variance[row] = propagate_variances(
            sum(gradients.values()) * np.sqrt(np.maximum(1 - shares[row], 0)), covariance[row]
        )
        for other, gradient in gradients.items():
            variance[row] += propagate_variances(gradient * np.sqrt(shares[other]), covariance[other])
        variance[row] += np.sum((by_inertia @ parts) ** 2, axis=0)
    return value, variance


def _inertia_kinds(model: BodyModel) -> Array:
    """Return which segments' inertias are wrong together, those of both sides: (kinds, segments), none if rigid.

    By the factor 1 + x that all inertias of a kind change the momentum changes by x times what its row says of the
    segments' momenta: the whole mass is known, so that the others' inertias fall as these rise.
    """
    if not model.has_joints:
        return np.zeros((0, len(model.segments)))
    stems = [without_side(segment.name) for segment in model.segments]
    kinds = np.array([[stem == kind for stem in stems] for kind in dict.fromkeys(stems)], float)
    mass = np.array([0.0 if segment.inertia is None else segment.inertia.mass_kg for segment in model.segments])
    return kinds - (kinds @ mass / mass.sum())[:, None]


def _rotation_covariance(covariance: Array, R: Array) -> Array:
    """Return the covariance (3 segments, 3 segments) of all rotations, the root's too in its own axes, bounded."""
    own = limit_rotation_variance(covariance)[3:, 3:]
    own[:3] = R.T @ own[:3]
    own[:, :3] = own[:, :3] @ R
    return own


def _independent_shares(fits: Sequence[_AngularVelocities], covariance: Array) -> Array:
    """Return which share of each rotation's variance is independent from frame to frame: (n, 3 segments).

    covariance (n, 3 segments, 3 segments) as stated. There is one share of the frames that show a rotation, as if one
    more squared distance had been as large as stated, and another of those that do not, as if one more had been as
    large as of those that do; above 1 where they are larger.
    """
    stated = np.diagonal(covariance, axis1=1, axis2=2)
    is_open = stated > 0.99 * _UNOBSERVED_ROTATION_SD_RAD**2
    is_shown = ~is_open & (stated > 0)
    shares, usual = np.ones_like(stated), np.ones(stated.shape[1])
    for of_kind in (is_shown, is_open):
        squared, freedom = usual.copy(), np.ones(stated.shape[1])
        for fit in fits:
            counts, variance = of_kind[fit.rows], stated[fit.rows]
            squares = fit.distance.reshape(variance.shape) ** 2
            squared += np.sum(squares / np.where(counts, variance, np.inf), axis=0)
            freedom += np.sum(fit.freedom[:, None] * counts, axis=0)
        shares = np.where(of_kind, squared / freedom, shares)
        mean = np.sum(shares * stated * is_shown, axis=0) / np.maximum(is_shown.sum(axis=0), 1)
        usual = np.where(is_shown.any(axis=0), mean / _UNOBSERVED_ROTATION_SD_RAD**2, 1.0)
    return shares


def limit_rotation_variance(covariance: Array) -> Array:
    """Return a covariance (d, d) in which unobserved rotations have a uniform circle's variance, not infinity."""
    is_unobserved = np.isinf(np.diagonal(covariance))
    is_unobserved[:3] = False
    bounded = np.where(is_unobserved[:, None] | is_unobserved, 0.0, covariance)
    return bounded + np.diag(np.where(is_unobserved, _UNOBSERVED_ROTATION_SD_RAD**2, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class _AngularVelocities:
    """Angular velocities at one frame: weighted sums of the rotation vectors to its neighbours."""

    value: Array  # (segments, 3) [rad/s], own axes
    rows: NDArray[np.intp]  # (m,) the frames of the fit
    weights: Array  # (m,) [1/s]
    rotation_vectors: Array  # (m, segments, 3) from the frame to those frames, own axes [rad]
    distance: Array  # (m, segments, 3) of these from the parabola [rad]
    freedom: Array  # (m,) share of a variance that is left in them


def _angular_velocities(rotations: Array, time_s: Array, row: int, rows: NDArray[np.intp]) -> _AngularVelocities | None:
    """Fit the angular velocities at one frame; None where it has no neighbour to fit."""
    relative = np.swapaxes(rotations[row], -1, -2) @ rotations[rows]
    vectors = Rotation.from_matrix(relative.reshape(-1, 3, 3)).as_rotvec().reshape(len(rows), -1, 3)
    is_near = np.linalg.norm(vectors, axis=-1).max(axis=-1) < _LARGEST_ROTATION_RAD
    here = int(np.flatnonzero(rows == row)[0])
    far = np.flatnonzero(~is_near)
    first, stop = max((k + 1 for k in far if k < here), default=0), min((k for k in far if k > here), default=len(rows))
    rows, vectors = rows[first:stop], vectors[first:stop]
    if len(rows) < 2:
        return None
    offset = time_s[rows] - time_s[row]
    scale = np.ptp(offset)  # keeps the powers of similar size
    powers = np.vander(offset / scale, min(3, len(rows)), increasing=True)
    inverse = np.linalg.pinv(powers)
    weights, left = inverse[1] / scale, np.eye(len(rows)) - powers @ inverse
    value, distance = np.tensordot(weights, vectors, axes=1), np.einsum("ij,jsk->isk", left, vectors)
    return _AngularVelocities(value, rows, weights, vectors, distance, np.diagonal(left))


def _gradients(model: BodyModel, R: Array, rates: _AngularVelocities, row: int):
    """Yield each frame of a fit with the momentum's gradient (3, 3 segments) by its rotations, own axes."""
    n = len(R)
    unit = np.eye(3 * n).reshape(-1, n, 3)
    by_rate = angular_momentum(model, R, unit).T  # (3, 3 segments); linear in the rates
    by_pose = _pose_gradient(model, R, rates.value)
    for other, weight, vectors in zip(rates.rows, rates.weights, rates.rotation_vectors, strict=True):
        if other == row:
            continue
        right = _inverse_right_jacobian(
            vectors
        )  # of log(A exp(m)) by m, at log A = vectors; of log(exp(m) A) transposed
        blocks = weight * by_rate.reshape(3, n, 3)
        by_pose = by_pose - np.einsum("isj,skj->isk", blocks, right).reshape(3, -1)
        yield other, np.einsum("isj,sjk->isk", blocks, right).reshape(3, -1)
    yield row, by_pose


def _pose_gradient(model: BodyModel, R: Array, rates: Array) -> Array:
    """Differentiate the momentum by the frame's own rotations at fixed rates: (3, 3 segments), own axes."""
    n = len(R)
    is_carried = np.eye(n, dtype=bool)
    for segment, parent in enumerate(model.parents[1:], start=1):
        is_carried[segment] |= is_carried[parent]
    axes = np.swapaxes(R, -1, -2).reshape(-1, 3)  # (3 segments, 3): each segment's x, y, z in the world
    rotated = [
        angular_momentum(model, np.where(np.repeat(is_carried.T, 3, axis=0)[..., None, None], step @ R, R), rates)
        for step in (Rotation.from_rotvec(sign * _STEP_RAD * axes).as_matrix()[:, None] for sign in (1, -1))
    ]
    return (rotated[0] - rotated[1]).T / (2 * _STEP_RAD)


def _inverse_right_jacobian(vectors: Array) -> Array:
    """Inverse right Jacobian of SO(3): log(exp(v) exp(m)) by m at 0, (..., 3, 3), for v (..., 3) shorter than pi."""
    angle = np.linalg.norm(vectors, axis=-1)
    safe = np.where(angle < 1e-3, 1.0, angle)
    c = np.where(angle < 1e-3, 1 / 12 + angle**2 / 720, 1 / safe**2 - 1 / (2 * safe * np.tan(safe / 2)))
    cross = np.cross(vectors[..., None, :], np.eye(3)).swapaxes(-1, -2)  # v x: column j is v x e_j
    return np.eye(3) + cross / 2 + c[..., None, None] * (cross @ cross)


def _stretches(motion: Motion) -> list[NDArray[np.intp]]:
    """Split the rows with a pose wherever a frame is lost or a time is missing."""
    rows = np.flatnonzero(motion.has_pose)
    if len(rows) < 2:
        return [rows] if len(rows) else []
    steps = np.diff(motion.time_s)
    reach = _SAME_PERIOD * float(np.median(steps))
    breaks = (np.diff(rows) > 1) | (motion.time_s[rows[1:]] - motion.time_s[rows[:-1]] > reach)
    return np.split(rows, np.flatnonzero(breaks) + 1)


def _window(stretch: NDArray[np.intp], row: int, window: int) -> NDArray[np.intp]:
    """Return the rows of a stretch nearest to one of them, shifted inward at the ends."""
    here = int(np.searchsorted(stretch, row))
    first = int(np.clip(here - window // 2, 0, max(len(stretch) - window, 0)))
    return stretch[first : first + window]
