"""The legs of a jumper: six points joined by rods of fixed lengths (block-jump paper, section 2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.errors import BodyError
from airborne.types import Array

LEG_POINTS = ("hip_left", "hip_right", "knee_left", "knee_right", "ankle_left", "ankle_right")
RODS = ((0, 2), (1, 3), (2, 4), (3, 5))  # thighs and shanks, left first, as pairs of LEG_POINTS
THIGH_WIDTH_M, SHANK_WIDTH_M = 0.15, 0.11  # of the rods' rectangles in the images


@dataclass(frozen=True, slots=True, kw_only=True)
class Legs:
    """Fixed lengths of one player's rods, and the distances between the legs in the first frame [m].

    The paper's "foot" is the end of the shank's rod, here the ankle's joint centre.
    """

    torso_to_hips_m: float  # L_B2H: torso to the middle of the hips
    half_pelvis_m: float  # L_H: the middle of the hips to one hip
    thigh_m: float  # L_T, mean of both sides
    shank_m: float  # L_S, mean of both sides
    knee_gap_m: float  # d_K
    foot_gap_m: float  # d_F

    @classmethod
    def from_points(cls, torso: Array, points: Array) -> Legs:
        """Measure a player in the first frame: torso (3,) and points (6, 3) [m], in the order of LEG_POINTS.

        Raises BodyError where points are missing, coincide or lie further apart than in any person.
        """
        torso, points = np.asarray(torso, float), np.asarray(points, float)
        if torso.shape != (3,) or points.shape != (len(LEG_POINTS), 3):
            raise BodyError(f"legs need a torso (3,) and points (6, 3); found {torso.shape} and {points.shape}")
        if not (np.isfinite(torso).all() and np.isfinite(points).all()):
            raise BodyError(f"legs need a place of the torso and of {', '.join(LEG_POINTS)}; one is missing")
        rods = [float(np.linalg.norm(points[a] - points[b])) for a, b in RODS]
        hips, knees, feet = points[0:2], points[2:4], points[4:6]
        legs = cls(
            torso_to_hips_m=float(np.linalg.norm(hips.mean(axis=0) - torso)),
            half_pelvis_m=float(np.linalg.norm(hips[0] - hips[1])) / 2,
            thigh_m=(rods[0] + rods[1]) / 2,
            shank_m=(rods[2] + rods[3]) / 2,
            knee_gap_m=float(np.linalg.norm(knees[0] - knees[1])),
            foot_gap_m=float(np.linalg.norm(feet[0] - feet[1])),
        )
        for name, length_m in (("thigh", legs.thigh_m), ("shank", legs.shank_m), ("pelvis", 2 * legs.half_pelvis_m)):
            if not 0.05 < length_m < 0.8:
                raise BodyError(
                    f"a {name} of {length_m:.2f} m is no person's; give the points in metres, 0.05 to 0.8 m"
                )
        return legs
