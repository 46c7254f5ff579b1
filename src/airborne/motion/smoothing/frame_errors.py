"""How far errors of landmarks and joint angles change from frame to frame, once a whole run is fitted.

A surface that lies beside the person's does so all run long. What that does to a landmark, or to a joint's rotation,
seen along the axes of its own segment, is a constant offset, as between two definitions of a joint, and a rest that
changes with the pose. A range of motion, a speed or a comparison without offsets has the rest alone in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.motion.isb import isb_angles, isb_gradients
from airborne.motion.joints import angle_gradients, joint_angles, landmark_jacobian, landmarks
from airborne.motion.motion import FrameDeviations, Motion
from airborne.motion.smoothing.run_fit import SmoothErrors
from airborne.motion.uncertainty import propagate_variances, standard_deviation
from airborne.types import Array

_Gradients = list[tuple[NDArray[np.int64], Array]]  # of each joint the columns (c,) that turn it, and (n, 3, c)


class ConstantOffsets(NamedTuple):
    """What stays the same, over some frames, of the errors that the surface gives: k of them, of an sd each."""

    rows: NDArray[np.intp]  # of the motion
    n_known: Array  # (landmarks,) frames that tell their means
    mean_m: Array  # (landmarks, 3, k) of the landmarks, in the axes of their segments
    saved_m2: Array  # (rows, landmarks), the mean of the axes': by how much variances are smaller without those means
    n_turns_known: Array  # (3 joints,) frames that tell their means
    mean_rad: Array  # (3 joints, k) of the joints' rotation vectors, in the axes of their segments
    saved_rad2: Array  # (rows, 2, joints, 3) of the x-y-z angles, and of those in ISB's sequences


def constant_offsets(
    model: BodyModel, rows: NDArray[np.intp], poses: Sequence[Pose], errors: SmoothErrors, *, kept: slice
) -> ConstantOffsets:
    """Find the constant offsets in the kept ones of some frames, over those that were fitted and know each.

    rows: of the motion, one for each pose.
    """
    owners, poses, of_surface = model.landmark_segments, poses[kept], errors.of_surface[kept]
    moved_m = np.zeros((len(poses), len(owners), 3, of_surface.shape[-1]))
    is_fitted = np.array([each.any() for each in of_surface], np.bool_)[:, None]
    is_known = np.repeat(is_fitted, len(owners), axis=1)
    for i, (pose, covariance) in enumerate(zip(poses, errors.covariances[kept], strict=True)):
        posed = model.with_pose(pose)
        jacobian = landmark_jacobian(posed)
        is_known[i] &= np.isfinite(propagate_variances(jacobian, covariance)).all(axis=-1)
        moved_m[i] = posed.R[owners].swapaxes(1, 2) @ (jacobian @ of_surface[i])
    n_known, mean_m = _mean(moved_m, is_known)
    saved_m2 = np.where(is_known, _mean_square(moved_m) - _mean_square(moved_m - mean_m), 0.0)
    turned = of_surface[:, 6:]
    is_known = is_fitted & np.isfinite(np.diagonal(errors.covariances[kept], axis1=1, axis2=2)[:, 6:])
    n_turns_known, mean_rad = _mean(turned, is_known)
    gradients = _gradients(model, poses)
    saved_rad2 = _variances(gradients, turned) - _variances(gradients, turned - mean_rad)
    saved_rad2[~is_fitted[:, 0]] = 0
    return ConstantOffsets(rows[kept], n_known, mean_m, saved_m2, n_turns_known, mean_rad, saved_rad2)


def frame_deviations(motion: Motion, model: BodyModel, offsets: Sequence[ConstantOffsets]) -> FrameDeviations:
    """Return the sds of errors that change from frame to frame, of a motion whose covariances hold the surface's.

    `offsets` are those of groups of frames; between two groups they are not the same, which counts as a change. That a
    joint lies beside its place counts as a change, too: it turns with the other of its segments.
    """
    mean_m = _join([each.n_known for each in offsets], [each.mean_m for each in offsets])
    mean_rad = _join([each.n_turns_known for each in offsets], [each.mean_rad for each in offsets])
    motion = replace(motion, lasting=None, by_frame=None)
    of_angles = joint_angles(motion, model)["angle_sd"], isb_angles(motion, model)["isb_angle_sd"]
    of_landmarks, of_angles = landmarks(motion, model)[1] ** 2, np.radians(np.stack(of_angles, axis=1)) ** 2
    for each in offsets:
        is_saved = each.saved_m2 != 0
        of_landmarks[each.rows] -= np.where(is_saved, each.saved_m2 - _mean_square(each.mean_m - mean_m), 0.0)
        gradients = _gradients(model, [motion.pose(row) for row in each.rows])
        between = np.broadcast_to(each.mean_rad - mean_rad, (len(each.rows), *mean_rad.shape))
        is_saved = each.saved_rad2 != 0
        of_angles[each.rows] -= np.where(is_saved, each.saved_rad2 - _variances(gradients, between), 0.0)
    of_landmarks, of_angles = (standard_deviation(np.maximum(each, 0)) for each in (of_landmarks, of_angles))
    return FrameDeviations(of_landmarks, of_angles[:, 0], of_angles[:, 1])


def _gradients(model: BodyModel, poses: Sequence[Pose]) -> tuple[_Gradients, _Gradients]:
    """Return how joints' rotations change their x-y-z angles, and those in ISB's sequences."""
    angles = np.array([pose.joint_angles for pose in poses])
    own = [(3 * joint + np.arange(3), each) for joint, each in enumerate(angle_gradients(angles).swapaxes(0, 1))]
    return own, isb_gradients(model, angles)


def _variances(gradients: tuple[_Gradients, _Gradients], turned: Array) -> Array:
    """Return angles' variances by errors of an sd each (n, 3 joints, k): (n, 2, joints, 3), 0 without a sequence."""
    of_both = [[gradient @ turned[:, columns] for columns, gradient in each] for each in gradients]
    return np.nan_to_num(np.square(np.array(of_both)).sum(axis=-1)).transpose(2, 0, 1, 3)


def _mean(errors: Array, is_known: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the numbers (...) of frames that know errors (n, ..., 3, k) or (n, ..., k), and the means of these."""
    n_known = is_known.sum(axis=0)
    wide = is_known.reshape(is_known.shape + (1,) * (errors.ndim - is_known.ndim))
    return n_known, np.sum(errors, axis=0, where=wide) / np.maximum(wide.sum(axis=0), 1)


def _join(counts: Sequence[Array], means: Sequence[Array]) -> Array:
    """Return the mean of groups' means (...), each with its counts, of the first dimension."""
    weights = np.array(counts, float)
    weights = weights.reshape(weights.shape + (1,) * (means[0].ndim - 1))
    return np.sum(weights * np.array(means), axis=0) / np.maximum(weights.sum(axis=0), 1)


def _mean_square(moved_m: Array) -> Array:
    """Return the mean over the axes of the sum over all errors of squares (..., 3, k)."""
    return np.asarray(np.square(moved_m).sum(axis=-1).mean(axis=-1))
