"""How far landmarks' errors change from frame to frame, once a whole run is fitted.

A surface that lies beside the person's does so all run long. What that does to a landmark, seen along the axes of its
own segment, is a constant offset, as between two definitions of a joint, and a rest that changes with the pose. A range
of motion, a speed or a comparison without offsets has the rest alone in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.motion.joints import landmark_jacobian, landmarks
from airborne.motion.motion import Motion
from airborne.motion.smoothing.run_fit import SmoothErrors
from airborne.motion.uncertainty import propagate_variances, standard_deviation
from airborne.types import Array


class ConstantOffsets(NamedTuple):
    """What stays the same, over some frames, of the errors that the surface gives to landmarks."""

    rows: NDArray[np.intp]  # of the motion
    n_known: Array  # (landmarks,) frames that tell them
    mean_m: Array  # (landmarks, 3, k) in the axes of their segments, of errors of the surface of an sd each
    variance_m2: Array  # (rows, landmarks), the mean of the axes', by which each is smaller without those means


def constant_offsets(
    model: BodyModel, rows: NDArray[np.intp], poses: Sequence[Pose], errors: SmoothErrors, kept: slice
) -> ConstantOffsets:
    """Find the landmarks' constant offsets in the kept ones of some frames, over those that were fitted and know each.

    rows: of the motion, one for each pose.
    """
    owners, poses, of_surface = model.landmark_segments, poses[kept], errors.of_surface[kept]
    moved_m = np.zeros((len(poses), len(owners), 3, of_surface.shape[-1]))
    is_known = np.zeros((len(poses), len(owners)), np.bool_)
    for i, (pose, covariance) in enumerate(zip(poses, errors.covariances[kept], strict=True)):
        posed = model.with_pose(pose)
        jacobian = landmark_jacobian(posed)
        is_known[i] = of_surface[i].any() & np.isfinite(propagate_variances(jacobian, covariance)).all(axis=-1)
        moved_m[i] = posed.R[owners].swapaxes(1, 2) @ (jacobian @ of_surface[i])
    n_known = is_known.sum(axis=0)
    mean_m = np.sum(moved_m, axis=0, where=is_known[..., None, None]) / np.maximum(n_known, 1)[:, None, None]
    saved_m2 = np.where(is_known, _mean_square(moved_m) - _mean_square(moved_m - mean_m), 0.0)
    return ConstantOffsets(rows[kept], n_known, mean_m, saved_m2)


def frame_deviations(motion: Motion, model: BodyModel, offsets: Sequence[ConstantOffsets]) -> Array:
    """Return the sds of landmarks' errors that change from frame to frame: (n, landmarks) [m].

    `offsets` are those of groups of frames; between two groups they are not the same, which counts as a change. That a
    joint lies beside its place counts as a change, too: it turns with the other of its segments.
    """
    n_known = np.array([each.n_known for each in offsets], float)
    shares = n_known / np.maximum(n_known.sum(axis=0), 1)
    mean_m = np.einsum("gl,glak->lak", shares, [each.mean_m for each in offsets])
    variance = landmarks(replace(motion, lasting=None), model)[1] ** 2
    for each in offsets:
        constant = each.variance_m2 - _mean_square(each.mean_m - mean_m)
        variance[each.rows] -= np.where(each.variance_m2 == 0, 0.0, constant)
    return standard_deviation(np.maximum(variance, 0))


def _mean_square(moved_m: Array) -> Array:
    """Return the mean over the axes of the sum over all errors of squares (..., 3, k)."""
    return np.asarray(np.square(moved_m).sum(axis=-1).mean(axis=-1))
