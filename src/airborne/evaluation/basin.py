"""Basin of convergence of a search: trials from perturbed poses about a known one, and their success rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airborne.body import Pose
from airborne.constants import NORMAL_QUANTILE_975
from airborne.geometry.rotations import geodesic
from airborne.types import Array

_RECOVERED_WITHIN_M = 0.010  # of the true position
_RECOVERED_WITHIN_RAD = np.deg2rad(2.0)  # likewise


@dataclass(frozen=True, slots=True)
class Basin:
    """How many trials recovered the true pose: within 10 mm and 2 degrees."""

    n: int
    n_recovered: int

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the success rate (Wilson's score interval); (0, 1) for no trial."""
        if not self.n:
            return 0.0, 1.0
        share, z2 = self.n_recovered / self.n, NORMAL_QUANTILE_975**2
        middle = (share + z2 / (2 * self.n)) / (1 + z2 / self.n)
        half = NORMAL_QUANTILE_975 / (1 + z2 / self.n) * np.sqrt(share * (1 - share) / self.n + z2 / (4 * self.n**2))
        return max(0.0, float(middle - half)), min(1.0, float(middle + half))

    def describe(self) -> str:
        """Return the rate and its interval in one line."""
        low, high = self.interval
        return f"{self.n_recovered} of {self.n} found again within 10 mm and 2 degrees (95 %: {low:.0%} to {high:.0%})"


def perturb(rng: np.random.Generator, pose: Pose, *, distance_m: float, angle_rad: float, n: int) -> list[Pose]:
    """Draw n poses exactly `distance_m` and `angle_rad` from `pose`, in directions and about axes uniform in space."""
    directions, axes = rng.normal(size=(2, n, 3))
    return [
        pose.move(distance_m * d / np.linalg.norm(d), angle_rad * a / np.linalg.norm(a))
        for d, a in zip(directions, axes, strict=True)
    ]


def is_recovered(estimate: Pose | None, true: Pose, symmetries: Sequence[Array]) -> bool:
    """Tell whether a search recovered the true pose, up to symmetry, within 10 mm and 2 degrees."""
    if estimate is None:
        return False
    a, b = estimate.world_from_root, true.world_from_root
    angle = geodesic(a.rotation.as_matrix() @ np.stack(list(symmetries)), b.rotation.as_matrix())
    distance = np.linalg.norm(a.translation - b.translation)
    return bool(distance <= _RECOVERED_WITHIN_M and angle.min() <= _RECOVERED_WITHIN_RAD)
