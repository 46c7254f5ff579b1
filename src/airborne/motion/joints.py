"""The joints of a body over time: landmark positions and joint angles."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, PosedBody
from airborne.body.chain import nearest_angles, point_jacobian
from airborne.body.shaping import half_widths_m
from airborne.body.sides import are_crossed, leg_pairs
from airborne.errors import ResultError
from airborne.geometry.rotations import (
    angles_from_matrix,
    angles_from_world_rotation,
    is_near_singular,
    matrix_from_angles,
)
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import propagate_variances, standard_deviation
from airborne.types import Array

if TYPE_CHECKING:
    import xarray as xr

OPEN_SD_RAD = 0.5  # of an angle that counts as unobserved
UNCERTAIN_SD_M = 0.05  # of a landmark; the same as of a whole body
# how far a person's joint lies beside its place, along each axis, as a share of the half width of the segments that
# meet there: the least with which 80 % of the errors of each kind of joint lie within two frames' sds, on eleven
# synthetic people, lengths 4 % and girths 12 % off
PLACE_SHARE = 0.05
_STRAINED_RAD, _STRAINED_FRAMES = np.radians(3.0), 3  # beyond a limit by more than its sd, in so many frames on end
# of synthetic people's tracked legs, with a body a tenth too tall, 16 % are over 0.1 m off with two cameras, with three
# hardly any
_SURE_VIEWS = 3


class JointStatus(StrEnum):
    """How far the position of one joint in one frame can be trusted."""

    TRACKED = "tracked"
    UNCERTAIN = "uncertain"
    UNKNOWN = "unknown"  # the images do not show where it is: what stands there is a guess
    LOST = "lost"


_FLEXION = {  # of a person: the segment that a joint turns, the joint, and the sign of its x angle in flexion
    "upper_arm": ("shoulder", -1.0),
    "forearm": ("elbow", -1.0),
    "thigh": ("hip", -1.0),
    "shank": ("knee", 1.0),
}
_MOST_JOINTS = 8  # of a body that is not a person, shown


def landmarks(motion: Motion, model: BodyModel) -> tuple[Array, Array]:
    """Return the body's landmarks (n, landmarks, 3) world [m], and their sd (n, landmarks) [m].

    The standard deviation is the root mean square over the axes, to first order, through every joint that moves the
    point, or the joint that it stands for, and by where that lies within a person: infinite where an unobserved
    direction moves it, NaN where unknown. Raises ResultError for another body.
    """
    points, sd, _ = landmarks_with_frame_sds(motion, model)
    return points, sd


def landmarks_with_frame_sds(motion: Motion, model: BodyModel) -> tuple[Array, Array, Array]:
    """Return `landmarks`, and the sd of errors that change from frame to frame: (n, landmarks) [m].

    After the fit of a whole run that is without what is constant in each one's segment, else without the root's lasting
    errors alone. Raises ResultError for another body.
    """
    require_body(motion, model)
    points, covariances = np.full((len(motion), len(model.landmarks), 3), np.nan), [motion.total_covariance]
    if motion.lasting is not None and motion.by_frame is None:
        covariances.append(motion.covariance)
    variances = np.full((len(covariances), *points.shape), np.nan)
    for row in np.flatnonzero(motion.has_pose):
        posed = model.with_pose(motion.pose(row))
        jacobian, points[row] = landmark_jacobian(posed), posed.landmarks
        for variance, covariance in zip(variances, covariances, strict=True):
            variance[row] = propagate_variances(jacobian, covariance[row])
    sds = standard_deviation(variances.mean(axis=-1) + _place_variance(model))
    return points, sds[0], sds[-1] if motion.by_frame is None else motion.by_frame.landmark_m


def landmark_jacobian(posed: PosedBody) -> Array:
    """Differentiate a body's landmarks, or the joints that they stand for, by its pose: (landmarks, 3, d)."""
    owners = posed.model.landmark_segments
    moved = np.where(_at_joint(posed.model)[:, None], posed.t[owners], posed.landmarks)
    return point_jacobian(posed, owners, moved)


def _place_variance(model: BodyModel) -> Array:
    """Return the variance of each landmark's place within its segment, a joint's within both: (landmarks,) [m2]."""
    owners = model.landmark_segments
    if not model.has_joints:
        return np.zeros(len(owners))
    sds = PLACE_SHARE * half_widths_m(model)
    return ((sds[owners] + sds[_carriers(model)]) / 2) ** 2


def joint_statuses(motion: Motion, model: BodyModel, sd: Array) -> NDArray[np.str_]:
    """Return how far each landmark can be trusted in each frame: (n, landmarks), values of `JointStatus`.

    sd (n, landmarks) [m] as `landmarks` gives it; where that is unknown none is tracked. A joint that may be elsewhere
    makes the landmarks of its segment uncertain, one beyond its limits for several frames on end those that hang on it,
    and crossed legs that fewer than three cameras show make theirs.
    """
    status = np.repeat(motion.status.astype("<U9")[:, None], sd.shape[1], axis=1)
    owners = model.landmark_segments
    is_doubtful = ~(sd <= UNCERTAIN_SD_M) | _is_strained(motion, model)[:, _carriers(model)] | _may_swap(motion, model)
    is_doubtful |= np.pad(motion.uncertain_joints, ((0, 0), (1, 0)))[:, owners]
    status[(status == JointStatus.TRACKED.value) & is_doubtful] = JointStatus.UNCERTAIN.value
    status[motion.has_pose[:, None] & np.isinf(sd)] = JointStatus.UNKNOWN.value
    return status


def known_landmarks(motion: Motion, model: BodyModel) -> tuple[Array, Array, NDArray[np.str_]]:
    """Return `landmarks`, NaN where no image shows them, and `joint_statuses`. Raises ResultError for another body."""
    points, sd = landmarks(motion, model)
    status = joint_statuses(motion, model, sd)
    is_guess = status == JointStatus.UNKNOWN.value
    return np.where(is_guess[..., None], np.nan, points), np.where(is_guess, np.nan, sd), status


def doubtful_segments(motion: Motion, model: BodyModel) -> NDArray[np.bool_]:
    """Return which segments have a landmark, or an end, that is not tracked: (n, segments)."""
    *_, status = known_landmarks(motion, model)
    doubtful = np.zeros((len(motion), len(model.segments)), np.bool_)
    for landmark, is_doubtful in zip(model.landmarks, (status != JointStatus.TRACKED.value).T, strict=True):
        segment = model.index_of(landmark.segment)
        doubtful[:, segment] |= is_doubtful
        if landmark.at_joint and segment > 0:
            doubtful[:, model.parents[segment]] |= is_doubtful
    return doubtful


def count_statuses(status: NDArray[np.str_], model: BodyModel) -> dict[str, dict[str, int]]:
    """Count in how many frames each landmark has each status, of `joint_statuses`: by landmark, then by status."""
    return {
        landmark.name: {each.value: int(np.sum(status[:, k] == each.value)) for each in JointStatus}
        for k, landmark in enumerate(model.landmarks)
    }


def _carriers(model: BodyModel) -> NDArray[np.int64]:
    """Return the segment whose joint moves each landmark, the parent of a segment for its origin: (landmarks,)."""
    owners = model.landmark_segments
    return np.where(_at_joint(model) & (owners > 0), model.parents[owners], owners)


@lru_cache(maxsize=16)  # asked for in every frame
def _at_joint(model: BodyModel) -> NDArray[np.bool_]:
    """Return which landmarks stand for their segments' joints: (landmarks,)."""
    return np.array([landmark.at_joint for landmark in model.landmarks])


def _is_strained(motion: Motion, model: BodyModel) -> NDArray[np.bool_]:
    """Say which segments' joints are beyond their limits in this frame and for several on end: (n, segments)."""
    excess = np.linalg.norm(model.limits.excess(matrix_from_angles(motion.joint_angles)), axis=-1)
    beyond = np.concatenate([np.zeros((len(motion), 1), bool), excess > _STRAINED_RAD], axis=1)
    strained = np.zeros_like(beyond)
    for first in range(len(motion) - _STRAINED_FRAMES + 1):
        window = slice(first, first + _STRAINED_FRAMES)
        strained[window] |= beyond[window].all(axis=0)
    return strained


def _may_swap(motion: Motion, model: BodyModel) -> NDArray[np.bool_]:
    """Say which landmarks are of legs that few cameras show crossed: they may be each other's (n, landmarks)."""
    rows, crossed = np.flatnonzero(motion.has_pose & (motion.n_views < _SURE_VIEWS)), np.zeros(len(motion), np.bool_)
    joints_m = model.pose_segments(motion.R[rows], motion.position[rows], motion.joint_angles[rows])[1]
    crossed[rows] = are_crossed(model, joints_m)
    owners = model.landmark_segments
    return crossed[:, None] & np.isin(owners, [segment for legs in leg_pairs(model) for segment in legs.ravel()])


def continuous_angles(motion: Motion) -> Array:
    """Return the joint angles (n, joints, 3) [rad], each row on the branch nearest to the last known row before it.

    Whole turns are added so that the mean of each curve lies within half a turn of zero, if it is shorter than a turn.
    """
    angles = np.array(motion.joint_angles)
    rows = np.flatnonzero(motion.has_pose)
    for before, row in pairwise(rows):
        angles[row] = nearest_angles(angles[row], angles[before])
    if len(rows):
        turns = np.round(angles[rows].mean(axis=0) / (2 * np.pi))
        angles[rows] -= 2 * np.pi * turns * (np.ptp(angles[rows], axis=0) < 2 * np.pi)
    return angles


def joint_angles(motion: Motion, model: BodyModel) -> xr.Dataset:
    """Compute the joint angles of a motion [deg], continuous over time, with standard deviations.

    Intrinsic x-y-z Cardan angles, parent from segment: R = Rx Ry Rz; a joint has the name of the segment that it
    rotates. Standard deviations follow from the covariance to first order: infinite where an unobserved rotation moves
    the angle, NaN where unknown, and within 5 degrees of y = +-90 (`is_singular`), where x and z are ambiguous. What
    changes from frame to frame, `angle_sd_frame`, is known apart after the fit of a whole run.
    Raises ResultError for another body's motion.
    """
    import xarray as xr

    require_body(motion, model)
    radians = continuous_angles(motion)
    by_rotation_vector = angle_gradients(radians)
    variance = np.full(radians.shape, np.nan)
    for row in np.flatnonzero(motion.has_pose):
        for joint in range(len(motion.joints)):
            block = slice(6 + 3 * joint, 9 + 3 * joint)
            variance[row, joint] = propagate_variances(
                by_rotation_vector[row, joint], motion.covariance[row, block, block]
            )
    variance[variance > OPEN_SD_RAD**2] = np.inf
    sd, by_frame = standard_deviation(variance), motion.by_frame
    dimensions = ("time", "joint", "axis")
    variables = {
        "angle": (dimensions, np.rad2deg(radians), {"units": "deg", "order": "x, y, z, body-fixed"}),
        "angle_sd": (dimensions, np.rad2deg(sd), {"units": "deg"}),
        "angle_sd_frame": (dimensions, np.rad2deg(sd if by_frame is None else by_frame.angle_rad), {"units": "deg"}),
        "is_singular": (dimensions[:2], is_near_singular(angles_from_matrix(matrix_from_angles(radians)))),
    }
    coordinates = {
        "time": ("time", motion.time_s, {"units": "s"}),
        "frame": ("time", motion.index),
        "joint": np.array(motion.joints, np.str_),
        "axis": list("xyz"),
    }
    return xr.Dataset(variables, coordinates, {"history": ["joint_angles: continuous over time"]})


def angle_gradients(joint_angles: Array) -> Array:
    """Differentiate x-y-z angles (..., 3) [rad] by a rotation vector in the turned segment's axes: (..., 3, 3).

    With y within +-90 degrees; of the other branch some have the other sign.
    """
    matrix = matrix_from_angles(joint_angles)
    return angles_from_world_rotation(angles_from_matrix(matrix)) @ matrix


def require_body(motion: Motion, model: BodyModel) -> None:
    """Raise ResultError where a motion is not of this body."""
    joints = tuple(segment.name for segment in model.segments[1:])
    if motion.joints != joints:
        joints_text, expected = (", ".join(names) or "none" for names in (motion.joints, joints))
        raise ResultError(
            f"the motion has the joints {joints_text}; body '{model.name}' has {expected}; give the run's body"
        )


def main_joints(joints: Sequence[str]) -> list[tuple[str, str, float]]:
    """Choose the joints that are shown: segment, label and sign of the x angle; of a person flexion is positive."""
    person = [
        (f"{segment}_{side}", f"{joint} {side}", sign)
        for segment, (joint, sign) in _FLEXION.items()
        for side in ("left", "right")
    ]
    present = [panel for panel in person if panel[0] in joints]
    return present or [(segment, f"{segment}, x", 1.0) for segment in joints[:_MOST_JOINTS]]
