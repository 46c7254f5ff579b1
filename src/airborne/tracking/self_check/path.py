"""The tracked poses of a run, as its self-check takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose
from airborne.body.chain import delta_between, move_pose
from airborne.types import Array


def alarm(subject: str, kind: str, *, value: float, sd: float, sentence: str) -> dict[str, Any]:
    """Return what `self_check` in summary.json holds of something wrong that no cause of the check explains."""
    return {"subject": subject, "kind": kind, "value": value, "sd": sd, "is_alarm": True, "sentence": sentence}


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPath:
    """The tracked poses of a run."""

    index: NDArray[np.int64]  # (n,) of the frames with a pose
    time_s: Array  # (n,)
    poses: Sequence[Pose]
    covariance: Array  # (n, 6, 6) of the root, by each frame's own pictures [m, rad]

    def row(self, index: int) -> int | None:
        """Return the row of a frame; None where it has no pose."""
        row = int(np.searchsorted(self.index, index))
        return row if row < len(self.index) and self.index[row] == index else None

    def velocity(self, row: int) -> Array:
        """Return the root's velocity by the poses beside: (6,) [m/s, rad/s]."""
        a, b = max(row - 1, 0), min(row + 1, len(self.poses) - 1)
        return delta_between(self.poses[a], self.poses[b])[:6] / max(self.time_s[b] - self.time_s[a], 1e-6)

    def pose_after(self, row: int, delay_s: float) -> Pose:
        """Return the pose a little later than a frame's."""
        delta = np.zeros(6 + self.poses[row].joint_angles.size)
        delta[:6] = delay_s * self.velocity(row)
        return move_pose(self.poses[row], delta) if delay_s else self.poses[row]

    @property
    def positions(self) -> Array:
        """The root's positions: (n, 3) [m]."""
        return np.array([pose.world_from_root.translation for pose in self.poses])

    @property
    def rotations(self) -> Array:
        """The root's orientations, world from root: (n, 3, 3)."""
        return np.array([pose.world_from_root.rotation.as_matrix() for pose in self.poses])

    @property
    def turns(self) -> Array:
        """Angles between the root's orientations at neighbouring poses: (n - 1,) [rad]."""
        rotations = [pose.world_from_root.rotation for pose in self.poses]
        return np.array([(b * a.inv()).magnitude() for a, b in pairwise(rotations)])
