"""What is known of a pose at one time beside the images: positions, pixels, angles, each with its sd."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.chain import delta_between, point_jacobian
from airborne.tracking.unobserved import with_unobserved, without_unobserved
from airborne.types import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoseEvidence:
    """Residuals of a pose in sds: the one rule that joins evidence of all forms is least squares.

    A pixel of one camera is two residuals: it says where a landmark is across the line of sight, and not how far.
    """

    model: BodyModel
    landmarks: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))  # (n,) of known position
    positions: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (n, 3) world [m]
    position_sds: Array = field(default_factory=lambda: np.zeros(0))  # (n,) [m]
    clicked: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))  # (m,) landmarks of known pixel
    P: Array = field(default_factory=lambda: np.zeros((0, 3, 4)))  # (m, 3, 4) projections without distortion
    px: Array = field(default_factory=lambda: np.zeros((0, 2)))  # (m, 2) without distortion
    px_sds: Array = field(default_factory=lambda: np.zeros(0))  # (m,)
    pose: Pose | None = None
    pose_sds: Array = field(default_factory=lambda: np.zeros(0))  # (6 + 3 joints,) [m, rad]; infinite: not known

    def residuals(self, pose: Pose) -> tuple[Array, Array]:
        """Return rows (k, 6 + 3 joints) and values (k,), in sds: `rows @ delta` is how the values change."""
        posed, used = self.model.with_pose(pose), np.concatenate([self.landmarks, self.clicked])
        owners = self.model.landmark_segments[used]
        points = posed.landmarks[used]
        jacobian = point_jacobian(posed, owners, points)
        n = len(self.landmarks)
        rows = [(jacobian[:n] / self.position_sds[:, None, None]).reshape(-1, self.model.n_dofs)]
        values = [((points[:n] - self.positions) / self.position_sds[:, None]).ravel()]
        h = np.einsum("mij,mj->mi", self.P[:, :, :3], points[n:]) + self.P[:, :, 3]
        in_front = h[:, 2] > 0
        h, P, sds = h[in_front], self.P[in_front], self.px_sds[in_front]
        px = h[:, :2] / h[:, 2:]
        px_from_point = (P[:, :2, :3] - px[..., None] * P[:, 2:, :3]) / h[:, 2, None, None]
        across = np.einsum("mij,mjd->mid", px_from_point, jacobian[n:][in_front])
        rows.append((across / sds[:, None, None]).reshape(-1, self.model.n_dofs))
        values.append(((px - self.px[in_front]) / sds[:, None]).ravel())
        if self.pose is not None:
            known = np.flatnonzero(np.isfinite(self.pose_sds))
            rows.append(np.eye(self.model.n_dofs)[known] / self.pose_sds[known, None])
            values.append(delta_between(self.pose, pose)[known] / self.pose_sds[known])
        return np.concatenate(rows), np.concatenate(values)

    def positions_of_landmarks(self) -> dict[str, Array]:
        """Return the landmarks of known position, and those that two cameras show: landmark -> (3,) [m]."""
        names = [landmark.name for landmark in self.model.landmarks]
        found = {names[i]: position for i, position in zip(self.landmarks, self.positions, strict=True)}
        for index in np.unique(self.clicked):
            own = self.clicked == index
            rows = self.P[own, :2] - self.px[own][..., None] * self.P[own, 2:]
            rows = (rows / np.linalg.norm(rows[..., :3], axis=-1, keepdims=True)).reshape(-1, 4)
            if own.sum() > 1:
                point = np.linalg.lstsq(rows[:, :3], -rows[:, 3], rcond=None)[0]
                found.setdefault(names[index], point)
        return found

    def add_to(self, covariance: Array, pose: Pose) -> Array:
        """Return the covariance (6 + 3 joints,) squared of a pose that the images gave, with the evidence added."""
        rows, n = self.residuals(pose)[0], self.model.n_dofs
        information = np.linalg.inv(without_unobserved(covariance, n)) + rows.T @ rows
        return with_unobserved(np.asarray(np.linalg.inv(information), float))
