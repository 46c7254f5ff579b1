"""A body's motion: every frame of a run as arrays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.errors import count
from airborne.motion.uncertainty import standard_deviation
from airborne.tracking import Estimate, Status
from airborne.types import Array


class FrameDeviations(NamedTuple):
    """Standard deviations of errors that change from frame to frame, without what lasts all run long."""

    landmark_m: Array  # (n, landmarks) root mean square over the axes
    angle_rad: Array  # (n, joints, 3) of the x-y-z angles
    isb_rad: Array  # (n, joints, 3) of the angles in ISB's sequences


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """The root's pose and its uncertainty over time; rows of lost frames are NaN.

    The covariance is that of `Estimate`: position [m], a rotation vector in world axes [rad], then for each joint a
    rotation vector in its segment's own axes [rad]. A variance is infinite where the images do not constrain that
    direction, NaN where it is unknown.
    """

    index: NDArray[np.int64]  # (n,) frame or field numbers
    time_s: Array  # (n,) [s]
    status: NDArray[np.str_]  # (n,) values of `Status`
    score: Array  # (n,) RMS colour difference [grey levels]
    n_views: NDArray[np.int64]  # (n,)
    position: Array  # (n, 3) [m]
    R: Array  # (n, 3, 3) world from root
    covariance: Array  # (n, 6 + 3 joints, 6 + 3 joints)
    joints: tuple[str, ...]  # names of the segments after the root; () for a body in one piece
    joint_angles: Array  # (n, joints, 3) x-y-z [rad]
    doubts: NDArray[np.str_]  # (n,) why frames are uncertain: values of `Doubt`, separated by slashes; "" for others
    uncertain_joints: NDArray[np.bool_]  # (n, joints) that may be elsewhere, whatever the covariance says
    lasting: Array | None = None  # (n, 6, 6) of the root's errors that last, or make its path rough
    by_frame: FrameDeviations | None = None  # of a run that was fitted as a whole

    @classmethod
    def collect(cls, estimates: Sequence[Estimate], joints: tuple[str, ...] = ()) -> Motion:
        """Stack the estimates of a run, in their order; `joints` names the rows of their poses' joint angles.

        A covariance of the root alone, (6, 6), leaves the joints' part unknown.
        """
        n, size = len(estimates), 6 + 3 * len(joints)
        position, R, covariance = np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan), np.full((n, size, size), np.nan)
        joint_angles, uncertain = np.full((n, len(joints), 3), np.nan), np.zeros((n, len(joints)), np.bool_)
        for row, estimate in enumerate(estimates):
            if estimate.pose is not None:
                world_from_root = estimate.pose.world_from_root.as_matrix()
                position[row], R[row] = world_from_root[:3, 3], world_from_root[:3, :3]
                joint_angles[row] = estimate.pose.joint_angles if estimate.pose.joint_angles.size else 0.0
            if estimate.covariance is not None:
                m = len(estimate.covariance)
                covariance[row, :m, :m] = estimate.covariance
            uncertain[row, list(estimate.uncertain_joints)] = True
        return cls(
            index=np.array([e.index for e in estimates], np.int64),
            time_s=np.array([float(e.time_s) for e in estimates], float),
            status=np.array([e.status.value for e in estimates], np.str_),
            score=np.array([e.score for e in estimates], float),
            n_views=np.array([e.n_views for e in estimates], np.int64),
            position=position,
            R=R,
            covariance=covariance,
            joints=joints,
            joint_angles=joint_angles,
            doubts=np.array(["/".join(e.doubts) for e in estimates], np.str_),
            uncertain_joints=uncertain,
        )

    def __len__(self) -> int:
        return len(self.index)

    def __repr__(self) -> str:
        counts = ", ".join(f"{self.count(status)} {status}" for status in Status)
        joints = f" of {count(len(self.joints), 'joint')}" if self.joints else ""
        return f"<Motion{joints}: {count(len(self), 'frame')}, {counts}>"

    def pose(self, row: int | np.integer) -> Pose:
        """Return the pose of one row that has one, bit for bit."""
        return Pose(
            world_from_root=rigid_transform(self.R[row], self.position[row]), joint_angles=self.joint_angles[row]
        )

    @property
    def has_pose(self) -> NDArray[np.bool_]:
        """Which frames have a pose: (n,)."""
        return np.asarray(np.isfinite(self.position).all(axis=-1))

    @property
    def quaternion(self) -> Array:
        """World from root as x, y, z, w with w >= 0: (n, 4)."""
        quaternion = np.full((len(self), 4), np.nan)
        if self.has_pose.any():
            quaternion[self.has_pose] = Rotation.from_matrix(self.R[self.has_pose]).as_quat(canonical=True)
        return quaternion

    @property
    def joint_quaternion(self) -> Array:
        """Parent from segment of each joint as x, y, z, w with w >= 0: (n, joints, 4)."""
        quaternion = np.full((*self.joint_angles.shape[:2], 4), np.nan)
        if self.joints and self.has_pose.any():
            angles = self.joint_angles[self.has_pose].reshape(-1, 3)
            of_poses = Rotation.from_euler("XYZ", angles).as_quat(canonical=True)
            quaternion[self.has_pose] = of_poses.reshape(-1, len(self.joints), 4)
        return quaternion

    @property
    def position_sd(self) -> Array:
        """Standard deviations of the position, of errors of the moment and of lasting ones: (n, 3) [m]."""
        return self._sd[:, :3]

    @property
    def rotation_sd(self) -> Array:
        """Standard deviations of the orientation, as a rotation vector in world axes: (n, 3) [rad]."""
        return self._sd[:, 3:6]

    @property
    def joint_rotation_sd(self) -> Array:
        """Standard deviations of the joints, as rotation vectors in the segments' own axes: (n, joints, 3) [rad]."""
        return self._sd[:, 6:].reshape(len(self), len(self.joints), 3)

    @property
    def total_covariance(self) -> Array:
        """Covariance of the errors of the moment and of lasting ones: (n, 6 + 3 joints, 6 + 3 joints)."""
        if self.lasting is None:
            return self.covariance
        total = self.covariance.copy()
        total[:, :6, :6] += self.lasting
        return total

    @property
    def _sd(self) -> Array:
        return standard_deviation(np.diagonal(self.total_covariance, axis1=-2, axis2=-1))

    def count_doubts(self) -> dict[str, int]:
        """Count the frames that each `Doubt` makes uncertain; the commonest first, those of none left out."""
        counts = Counter(doubt for doubts in self.doubts.tolist() for doubt in doubts.split("/") if doubt)
        return dict(counts.most_common())

    def count(self, status: Status) -> int:
        """Count the frames of one status."""
        return int(np.sum(self.status == status.value))


def rigid_transform(R: Array, position: Array) -> RigidTransform:
    """Build the rigid transform x -> R x + position, keeping every bit of R (3, 3), which must be a rotation."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, position
    return RigidTransform(matrix, normalize=False)
