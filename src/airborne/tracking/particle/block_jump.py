"""The block-jump paper's model of a block (section 4): swinging rods, and distances within and between bodies.

Step lengths and standard deviations are our choice where the paper states none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airborne.tracking.particle.distances import gap_term, length_term, ownership_term, position_term
from airborne.tracking.particle.mixture import hips_length_terms
from airborne.tracking.particle.situation import Situation
from airborne.tracking.particle.swing import Swing, draw_directions, draw_length_changes, reach, swing_rods
from airborne.types import Array

_LEG_LENGTH_SD_M, _HIPS_LENGTH_SD_M = 0.03, 0.02  # of delta_z
_POSITION_SD_M = {"hips": 0.05, "knees": 0.07, "ankles": 0.10}  # of a joint about its last place
_OUTWARD = (1.0, -1.0)  # left is where the line from the right hip to the left one points
_SHORTEST_ROD_M = 0.01  # keeps a rod's direction defined


class Rod(NamedTuple):
    """A rod to swing, and how far its end may move."""

    length_m: float
    sd_m: float  # of its change of length
    max_step_m: float  # largest step in x and y
    outward: Array | None = None  # (2,) away from the other leg; None: all directions are equivalent
    gap_m: float = 0.0  # distance to the other leg


@dataclass(frozen=True, slots=True)
class BlockJump:
    """Particles at the ends of swinging rods (equations 11 and 12), weighted by all distances (equation 13)."""

    swing: Swing

    def predict_hips(self, rng: np.random.Generator, hips: Array, now: Situation) -> Array:
        """Swing the middle of the hips from the torso, then each hip from that middle."""
        before = hips.mean(axis=1) + now.shift
        max_step_m = now.max_step_m("hips")
        down = _side(before[:, 2] - (now.torso_before + now.shift)[2])
        spine = Rod(now.legs.torso_to_hips_m, _HIPS_LENGTH_SD_M, max_step_m)
        middle = self._swing(rng, before, now.torso, rod=spine, side=down, now=now)
        hip_points = []
        for s in (0, 1):
            up_or_down = rng.choice([-1.0, 1.0], len(hips))  # a hip may be above or below the middle
            gap_m, outward = 2 * now.legs.half_pelvis_m, _OUTWARD[s] * hip_axis(now.previous)
            pelvis = Rod(now.legs.half_pelvis_m, _HIPS_LENGTH_SD_M, max_step_m, outward, gap_m)
            hip_points.append(self._swing(rng, hips[:, s] + now.shift, middle, rod=pelvis, side=up_or_down, now=now))
        return np.stack(hip_points, axis=1)

    def predict_leg(self, rng: np.random.Generator, leg: Array, side: int, now: Situation) -> Array:
        """Swing the ankle from the previous knee, then the knee back from the new ankle."""
        knee, ankle = leg[:, 0] + now.shift, leg[:, 1] + now.shift
        outward, down = _OUTWARD[side] * hip_axis(now.previous), _side(ankle[:, 2] - knee[:, 2])
        knees_apart, feet_apart = (float(np.linalg.norm(np.diff(now.previous[at], axis=0))) for at in ([2, 3], [4, 5]))
        ankle_step_m = now.max_step_m("ankles") * (0.5 if now.is_airborne else 1.0)
        shank = Rod(now.legs.shank_m, _LEG_LENGTH_SD_M, ankle_step_m, outward, feet_apart)
        new_ankle = self._swing(rng, ankle, knee, rod=shank, side=down, now=now)
        back = Rod(now.legs.shank_m, _LEG_LENGTH_SD_M, now.max_step_m("knees"), outward, knees_apart)
        new_knee = self._swing(rng, knee, new_ankle, rod=back, side=-down, now=now)
        return np.stack([new_knee, new_ankle], axis=1)

    def hips_terms(self, hips: Array, now: Situation) -> Array:
        """Score L_B2H, L_H, other players and the previous position."""
        return hips_length_terms(hips, now) + _position_terms(hips, now, "hips", (0, 1))

    def leg_terms(self, leg: Array, side: int, now: Situation) -> Array:
        """Score L_S, other players and the previous position."""
        shank = length_term(np.linalg.norm(leg[:, 0] - leg[:, 1], axis=-1), now.legs.shank_m)
        knees, ankles = leg[:, :1], leg[:, 1:]
        return (
            shank
            + _position_terms(knees, now, "knees", (2 + side,))
            + _position_terms(ankles, now, "ankles", (4 + side,))
        )

    def thigh_terms(self, hip: Array, knee: Array, now: Situation) -> Array:
        """Score L_T."""
        return length_term(np.linalg.norm(hip - knee, axis=-1), now.legs.thigh_m)

    def pair_terms(self, left: Array, right: Array, now: Situation) -> Array:
        """Score d_K and d_F."""
        apart = np.linalg.norm(left - right, axis=-1)
        return gap_term(apart[..., 0], now.legs.knee_gap_m) + gap_term(apart[..., 1], now.legs.foot_gap_m)

    def _swing(
        self, rng: np.random.Generator, before: Array, start: Array, *, rod: Rod, side: Array, now: Situation
    ) -> Array:
        n = len(before)
        direction = draw_directions(rng, n)
        reach_m = reach(direction, rod.outward, max_step_m=rod.max_step_m, gap_m=rod.gap_m)
        steps = direction * (rng.random(n) * reach_m)[:, None]
        upward = np.where(rng.random(n) < now.share_above, 1.0, -1.0)
        lengths = np.maximum(rod.length_m + side * upward * draw_length_changes(rng, n, rod.sd_m), _SHORTEST_ROD_M)
        return swing_rods(before, start, steps, lengths_m=lengths, side=side, swing=self.swing)


def hip_axis(points: Array) -> Array:
    """Return the horizontal unit vector from the right hip to the left one: points (6, 3) -> (2,)."""
    line = (points[0] - points[1])[:2]
    far = np.hypot(*line)
    return line / far if far > 1e-9 else np.array([1.0, 0.0])


def _position_terms(points: Array, now: Situation, joint: str, at: tuple[int, ...]) -> Array:
    """Score points (n, k, 3) by other players, and by their distance from the last estimates of rows `at`: (n,)."""
    others = ownership_term(points, now.torso, now.others).sum(axis=1)
    return others + sum(
        position_term(points[:, i], now.previous[k] + now.shift, _POSITION_SD_M[joint]) for i, k in enumerate(at)
    )


def _side(height: Array) -> Array:
    """Return u of equation 12: +1 above the start point, else -1."""
    return np.where(height > 0, 1.0, -1.0)
