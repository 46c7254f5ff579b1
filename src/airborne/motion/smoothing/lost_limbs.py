"""Limbs that were lost for some frames: where they may be, between where they were and where they were found again.

A tracker that loses a limb may see it somewhere else, in frames in which it says that it does not know the limb. The
images of such a frame agree with that place well enough that a fit of the whole run stays there, and draws the frames
beside along. So the fit starts from the shortest way between the frames that know the limb.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from airborne.body import BodyModel, Pose
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.motion.smoothing.run_fit import Stretch
from airborne.tracking.model_based.degrees_of_freedom import joints_of, limbs_of
from airborne.tracking.model_based.misplaced_limbs import DISTINCT_M, limb_points
from airborne.types import Array


def bridge_lost_limbs(
    model: BodyModel, poses: Sequence[Pose], time_s: Array, *, covariances: Array, stretches: Sequence[Stretch]
) -> list[Pose]:
    """Return the poses (n,) at the times [s], with limbs that jump while unknown on the way between other frames.

    A limb is unknown where a variance of its joints (covariances (n, d, d)) is not finite. It jumps where some joint
    of it is further than `DISTINCT_M` from midway between where it is in the frames before and after. Unknown frames
    to which it does not jump from known ones stay as they are.
    """
    bridged = list(poses)
    for limb in limbs_of(model):
        columns = joints_of(model, limb).columns
        is_known = np.asarray(np.isfinite(covariances[:, columns, columns]).all(axis=1))
        for stretch in stretches:
            for gap in _gaps(is_known, stretch.rows):
                around = slice(max(gap.start - 2, stretch.rows.start), min(gap.stop + 2, stretch.rows.stop))
                jumps = np.flatnonzero(_jumps(_places(model, bridged[around], limb))) + around.start + 1
                lost = _between_jumps(jumps, gap)
                if lost.start < lost.stop:
                    others = [*bridged[: lost.start], *_way(bridged, time_s, lost, limb), *bridged[lost.stop :]]
                    if not _jumps(_places(model, others[around], limb)).any():
                        bridged = others
    return bridged


def _gaps(is_known: NDArray[np.bool_], rows: slice) -> Iterator[slice]:
    """Yield the rows that are not known on end, between two of a stretch that are."""
    known = np.flatnonzero(is_known[rows]) + rows.start
    for before, after in zip(known[:-1].tolist(), known[1:].tolist(), strict=True):
        if after - before > 1:
            yield slice(before + 1, after)


def _between_jumps(jumps: NDArray[np.intp], gap: slice) -> slice:
    """Return the rows of a gap from which a limb comes back by a jump; all of it where there is no coming back.

    A row that is right counts as a jump beside one that is not.
    """
    if not len(jumps):
        return slice(0, 0)
    first, last = int(jumps[0]) + 1, int(jumps[-1]) - 1
    return slice(max(first, gap.start), min(last + 1, gap.stop)) if first <= last else gap


def _way(poses: Sequence[Pose], time_s: Array, gap: slice, limb: NDArray[np.int64]) -> list[Pose]:
    """Return the poses of a gap with the limb's joints turned at a constant rate from the pose before to that after."""
    joints, ends = limb - 1, [gap.start - 1, gap.stop]
    angles = np.array([pose.joint_angles for pose in poses[gap]])
    R = np.array([matrix_from_angles(poses[end].joint_angles[joints]) for end in ends])
    for i, joint in enumerate(joints):
        path = Slerp(time_s[ends], Rotation.from_matrix(R[:, i]))
        angles[:, joint] = angles_from_matrix(path(time_s[gap]).as_matrix())
    return [replace(pose, joint_angles=each) for pose, each in zip(poses[gap], angles, strict=True)]


def _places(model: BodyModel, poses: Sequence[Pose], limb: NDArray[np.int64]) -> Array:
    """Return where a limb's joints and landmarks are, in the axes of the segment that it hangs on: (n, points, 3)."""
    parent = int(model.parents[limb[0]])
    bodies = [model.with_pose(pose) for pose in poses]
    points = limb_points(model, bodies, limb)
    return np.array([(each - body.t[parent]) @ body.R[parent] for each, body in zip(points, bodies, strict=True)])


def _jumps(places: Array) -> NDArray[np.bool_]:
    """Say of which rows, but the first and the last, a limb is off the middle of those before and after: (n - 2,)."""
    off = places[1:-1] - (places[:-2] + places[2:]) / 2
    return np.linalg.norm(off, axis=2).max(axis=1, initial=0.0) > DISTINCT_M
