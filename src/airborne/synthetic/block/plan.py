"""The plan of a jump: the body's posture and the height of the centre of mass at its key times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from airborne.synthetic.block.legs import axis_rotation, roll_foot
from airborne.synthetic.block.posture import Feet, Person, solve_stance, upper_body_angles
from airborne.synthetic.block.steps import Approach, foot_placements
from airborne.types import Array

Arms = Literal["block", "attack", "low"]

TAKEOFF_PITCH = (np.radians(35.0), 13.0, -60.0)  # of the feet [rad, rad/s, rad/s^2]
TOUCH_PITCH = (np.radians(26.0), -11.0, 0.0)  # likewise, at touch-down
CENTRE_AHEAD_M, CENTRE_AHEAD_LOW_M = (
    0.02,
    -0.01,
)  # of the centre of mass ahead of the feet's midpoint: standing, at its lowest
CENTRE_AHEAD_TAKEOFF_M, _CENTRE_AHEAD_TOUCH_M = 0.085, 0.05  # likewise, at take-off and touch-down
_HEIGHTS_PER_REACH, _N_HEIGHTS = (0.75, 1.5), 48  # of the centre of mass, sampled, over a leg's length
_DRIFT_LEAD_S = 0.1  # feet land ahead of a drifting body by its drift in this time


class KeyPosture(NamedTuple):
    """Posture of pelvis, trunk, head and arms at a key time, in degrees; see `upper_body_angles`."""

    pitch: float  # of the pelvis, forward
    trunk: float
    head: float
    arms: tuple[float, float]
    elbows: tuple[float, float]
    abduction: float = 8.0

    def angles(self, person: Person) -> Array:
        """Return the joint angles (17, 3) [rad], legs straight."""
        return upper_body_angles(
            person, trunk=self.trunk, head=self.head, arms=self.arms, elbows=self.elbows, abduction=self.abduction
        )


READY = KeyPosture(15, 14, -16, (35, 35), (120, 120))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JumpPlan:
    """The parameters of a jump; angles in degrees, of knees their flexion."""

    rise_m: float  # of the centre of mass after take-off
    position: Array  # (2,) x, y of the feet's midpoint at take-off [m]
    yaw: float  # about z: 0 faces -y, pi faces +y [rad]
    drift_m_s: Array  # (2,) horizontal velocity in flight
    approach: Approach = "static"
    approach_m: float = 0.0  # of the approach, along x
    crouch_s: float = 0.32
    width_m: float = 0.36  # between the feet
    knee_ready: float = 38.0
    knee_crouch: float = 92.0
    knee_takeoff: float = 32.0
    knee_touch: float = 34.0
    knee_landing: float = 87.0
    knee_peak: float = 14.0
    hip_peak: float = 16.0
    ankle_peak: float = 24.0
    arms: Arms = "block"
    tilt: float = 20.0  # of the arms at the peak, from upright forward

    @property
    def forward(self) -> Array:
        """The direction that the player faces: (2,), unit."""
        return np.array([np.sin(self.yaw), -np.cos(self.yaw)])

    @property
    def touch_offset_m(self) -> Array:
        """The centre of mass at touch-down relative to the feet's midpoint: (2,) [m]."""
        return _CENTRE_AHEAD_TOUCH_M * self.forward - _DRIFT_LEAD_S * self.drift_m_s

    @property
    def key_postures(self) -> dict[str, KeyPosture]:
        """The postures at the key times."""
        up = 178.0 - self.tilt
        swing = {
            "block": (
                KeyPosture(36, 24, -32, (35, 35), (125, 125)),
                KeyPosture(6, 4, -18, (115, 115), (85, 85)),
                KeyPosture(9, 8, -8, (up, up), (6, 6), 6),
            ),
            "attack": (
                KeyPosture(38, 24, -30, (-45, -45), (15, 15)),
                KeyPosture(4, 0, -20, (125, 120), (20, 70)),
                KeyPosture(8, 6, -12, (110, up), (25, 15), 14),
            ),
            "low": (
                KeyPosture(34, 22, -28, (10, 10), (60, 60), 14),
                KeyPosture(6, 4, -12, (45, 45), (60, 60), 14),
                KeyPosture(8, 6, -10, (60, 60), (50, 50), 18),
            ),
        }[self.arms]
        return {
            "ready": READY,
            **dict(zip(("bottom", "takeoff", "peak"), swing, strict=True)),
            "fold": KeyPosture(12, 9, -10, (100, 100), (120, 120), 12),
            "touch": KeyPosture(14, 10, -10, (35, 35), (125, 125), 14),
            "low": KeyPosture(30, 20, -24, (10, 10), (110, 110), 18),
            "end": KeyPosture(13, 12, -14, (25, 25), (105, 105), 12),
        }


class CentreHeights(NamedTuple):
    """Heights of the centre of mass [m]."""

    ready: float
    bottom: float
    takeoff: float
    touch: float
    low: float
    end: float


def centre_heights(person: Person, plan: JumpPlan) -> CentreHeights:
    """Find the heights of the centre of mass at the key times from the flexion of the knees."""
    near, postures = CENTRE_AHEAD_M * plan.forward, plan.key_postures

    def height(posture: str, knee: float, offset: Array = near, pitch: float = 0.0) -> float:
        placements = foot_placements(plan.position, plan.yaw, plan.width_m)
        return centre_height(
            person,
            postures[posture],
            placements,
            over=plan.position + offset,
            yaw=plan.yaw,
            knee=np.radians(knee),
            pitch=pitch,
        )

    return CentreHeights(
        ready=height("ready", plan.knee_ready),
        bottom=height("bottom", plan.knee_crouch, CENTRE_AHEAD_LOW_M * plan.forward),
        takeoff=height("takeoff", plan.knee_takeoff, CENTRE_AHEAD_TAKEOFF_M * plan.forward, TAKEOFF_PITCH[0]),
        touch=height("touch", plan.knee_touch, plan.touch_offset_m, TOUCH_PITCH[0]),
        low=height("low", plan.knee_landing, CENTRE_AHEAD_LOW_M * plan.forward),
        end=height("end", plan.knee_ready),
    )


def centre_height(
    person: Person, posture: KeyPosture, placements: Array, *, over: Array, yaw: float, knee: float, pitch: float = 0.0
) -> float:
    """Return the height of the centre of mass [m] at which the mean flexion of the knees is `knee` [rad].

    Feet stand at `placements` (2, 3) with their heels raised by `pitch`; `over` (2,) [m] is x, y of the centre of mass.
    """
    reach = person.leg.thigh_m + person.leg.shank_m
    heights = np.linspace(*_HEIGHTS_PER_REACH, _N_HEIGHTS) * reach
    ones = np.ones(_N_HEIGHTS)
    R = axis_rotation(2, yaw * ones) @ axis_rotation(0, np.radians(posture.pitch) * ones)
    ankles, R_feet = zip(
        *(
            roll_foot(person.leg, np.tile(placement, (_N_HEIGHTS, 1)), pitch * ones, 0 * ones)
            for placement in placements
        ),
        strict=True,
    )
    centres = np.column_stack([np.tile(over, (_N_HEIGHTS, 1)), heights])
    angles = np.tile(posture.angles(person), (_N_HEIGHTS, 1, 1))
    poses = solve_stance(person, R, angles, feet=Feet(np.stack(ankles), np.stack(R_feet)), centre=centres)
    flexion = poses.joint_angles[:, person.knees, 0].mean(axis=1)
    can_stand = np.isfinite(flexion)
    return float(np.interp(-knee, -flexion[can_stand], heights[can_stand]))
