"""The players: random bodies, clothes and movements of blockers, team mates and opponents."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from airborne.body import BodyModel, Outfit, human18
from airborne.errors import TrialError
from airborne.synthetic.block.jump import build_jump
from airborne.synthetic.block.margins import BodyVolume, capsules_of, margins_of
from airborne.synthetic.block.motion import Movement, translate
from airborne.synthetic.block.plan import JumpPlan, KeyPosture
from airborne.synthetic.block.posture import Poses
from airborne.synthetic.block.steps import Approach
from airborne.synthetic.block.waiting import WaitPlan, wait
from airborne.types import Array

Role = Literal["blocker", "team mate", "opponent"]

CLEARANCE_M = 0.03  # between two players, and to the net
_ROUNDING_M = 1e-9  # of heights over the floor
_CHECK_S = 0.02  # between checks of a movement
_LARGEST_ACCELERATION_M_S2 = 30.0  # acceleration of the centre of mass by the legs
_APPROACHES_M: dict[Approach, tuple[float, float]] = {
    "static": (0.0, 0.0),
    "shuffle": (0.35, 1.1),
    "crossover": (0.8, 1.1),
}
_SKINS = np.array([[206, 160, 130], [188, 140, 110], [214, 172, 146], [150, 108, 84], [196, 152, 118]], float)
_HAIRS = ((38, 30, 25), (22, 22, 22), (90, 66, 44), (150, 121, 80))  # sRGB
_SHOES = ((222, 222, 218), (203, 69, 63), (226, 196, 64), (60, 64, 72))  # sRGB
_SHIRT, _SHORTS, _SOCKS = (196, 48, 56), (26, 26, 30), (40, 40, 45)  # of the blockers' team
_OTHER_SHIRT, _OTHER_SHORTS, _OTHER_SOCKS = (40, 80, 180), (226, 226, 230), (232, 232, 228)  # sRGB, of the other team


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Player:
    """One player of a scene."""

    name: str
    role: Role
    stature_m: float
    outfit: Outfit
    body: BodyModel  # a human18
    movement: Movement
    takeoff_s: float | None  # on the scene's clock; None: does not jump

    @property
    def side(self) -> float:
        """The side of the net: -1 for y < 0, where the blockers are."""
        return 1.0 if self.role == "opponent" else -1.0

    @property
    def touch_s(self) -> float | None:
        """The time of touch-down on the scene's clock."""
        flight = self.movement.flight
        return None if flight is None or self.takeoff_s is None else self.takeoff_s + flight.duration_s

    def poses(self, time_s: Array) -> Poses:
        """Return the poses at the scene's times (n,) [s]."""
        return self.movement(np.asarray(time_s, float) - (self.takeoff_s or 0.0))

    def translate(self, shift: Array) -> Player:
        """Return the player with the same movement shifted by `shift` (2,) [m]."""
        return replace(self, movement=translate(self.movement, shift))


def draw_person(rng: np.random.Generator, *, is_opponent: bool, similarity: float) -> tuple[float, Outfit, BodyModel]:
    """Draw a player's stature [m], clothes and body.

    `similarity` 1 gives opponents the leg colours of the blockers' team, 0 their own.
    """
    stature = float(np.clip(rng.normal(1.86, 0.06), 1.70, 2.05))
    mass = float(np.clip(22.2 * stature**2 + rng.normal(0, 4), 60, 110))

    def own(team: tuple[int, ...], other: tuple[int, ...]) -> tuple[float, float, float]:
        mixed = similarity * np.array(team) + (1 - similarity) * np.array(other)
        r, g, b = (float(c) for c in mixed)
        return r, g, b

    skin = _SKINS[rng.integers(len(_SKINS))] * rng.uniform(0.95, 1.05)
    outfit = Outfit(
        skin=tuple(skin.tolist()),
        hair=_HAIRS[rng.integers(len(_HAIRS))],
        shirt=_OTHER_SHIRT if is_opponent else _SHIRT,
        shorts=own(_SHORTS, _OTHER_SHORTS) if is_opponent else _SHORTS,
        socks=own(_SOCKS, _OTHER_SOCKS) if is_opponent else _SOCKS,
        shoes=_SHOES[rng.integers(len(_SHOES))],
        shorts_share=float(rng.uniform(0.45, 0.6)),
        socks_share=float(rng.uniform(0.12, 0.3)),
    )
    return stature, outfit, human18(round(stature, 3), round(mass, 1), outfit=outfit)


def draw_blocker(
    rng: np.random.Generator,
    name: str,
    x: float,
    *,
    takeoff_s: float,
    approach: Approach,
    direction: float,
    duration_s: float,
) -> Player:
    """Draw a blocker who takes off near x [m] at `takeoff_s`, after an approach along x in the direction +1 or -1."""
    stature, outfit, body = draw_person(rng, is_opponent=False, similarity=1.0)
    rise = float(np.clip(rng.normal(0.47, 0.06), 0.30, 0.62))
    low, high = _APPROACHES_M[approach]
    plan = JumpPlan(
        rise_m=rise,
        position=np.array([x, rng.uniform(-0.75, -0.64)]),
        yaw=float(np.pi + rng.normal(0, 0.06)),
        drift_m_s=np.array([direction * rng.uniform(-0.05, 0.4), rng.uniform(0.0, 0.12)]),
        approach=approach,
        approach_m=float(direction * rng.uniform(low, high)),
        knee_ready=float(rng.uniform(34, 42) + (12 if approach == "crossover" else 0)),
        knee_crouch=float(78 + 55 * (rise - 0.3) + rng.uniform(0, 5)),
        knee_landing=float(rng.uniform(74, 85)),
        hip_peak=float(rng.uniform(10, 25)),
        knee_peak=float(rng.uniform(6, 24)),
        width_m=float(rng.uniform(0.3, 0.42)),
        crouch_s=float(rng.uniform(0.27, 0.38)),
        tilt=float(rng.uniform(14, 26)),
    )
    player_with = partial(
        Player, name=name, role="blocker", stature_m=stature, outfit=outfit, body=body, takeoff_s=takeoff_s
    )
    return _move_clear_of_net(player_with(movement=build_jump(body, plan)), duration_s)


def draw_attacker(
    rng: np.random.Generator, name: str, x: float, *, takeoff_s: float, similarity: float, duration_s: float
) -> Player:
    """Draw an opponent who jumps for a spike near x [m]."""
    stature, outfit, body = draw_person(rng, is_opponent=True, similarity=similarity)
    plan = JumpPlan(
        rise_m=float(np.clip(rng.normal(0.66, 0.04), 0.55, 0.71)),
        position=np.array([x, rng.uniform(1.1, 1.4)]),
        yaw=float(rng.normal(0, 0.1)),
        drift_m_s=np.array([rng.uniform(-0.2, 0.2), rng.uniform(-0.3, -0.1)]),
        knee_ready=50.0,
        knee_crouch=91.0,
        knee_landing=82.0,
        width_m=0.32,
        arms="attack",
    )
    player_with = partial(
        Player, name=name, role="opponent", stature_m=stature, outfit=outfit, body=body, takeoff_s=takeoff_s
    )
    return _move_clear_of_net(player_with(movement=build_jump(body, plan)), duration_s)


def draw_bystander(
    rng: np.random.Generator, name: str, position: Array, *, is_opponent: bool, similarity: float, duration_s: float
) -> Player:
    """Draw a player who stays on the floor at `position` (2,) [m]; some shuffle there."""
    stature, outfit, body = draw_person(rng, is_opponent=is_opponent, similarity=similarity)
    reach, bend = rng.uniform(15, 60), rng.uniform(30, 100)
    plan = WaitPlan(
        position=position,
        yaw=float((0.0 if is_opponent else np.pi) + rng.normal(0, 0.35)),
        knee=float(rng.uniform(25, 62)),
        width_m=float(rng.uniform(0.35, 0.55)),
        approach_m=float(rng.choice([0.0, rng.uniform(-0.7, 0.7)])),
        arrival_s=float(rng.uniform(0.3, 0.8) * duration_s),
        duration_s=duration_s,
        posture=KeyPosture(
            rng.uniform(12, 28), rng.uniform(8, 22), -20.0, (reach, reach), (bend, bend), rng.uniform(8, 25)
        ),
    )
    role: Role = "opponent" if is_opponent else "team mate"
    movement = wait(rng, body, plan)
    player = Player(
        name=name, role=role, stature_m=stature, outfit=outfit, body=body, movement=movement, takeoff_s=None
    )
    return _move_clear_of_net(player, duration_s)


def _move_clear_of_net(player: Player, duration_s: float) -> Player:
    """Move the player far enough from the net; raises TrialError for an impossible movement."""
    time_s, centre_z = sample_times(duration_s), player.movement.before.centre_z
    margins = margins_of(player.movement.person, player.poses(time_s), side=player.side)
    largest_acceleration = np.abs(centre_z(np.linspace(centre_z.x[0], centre_z.x[-1], 200), 2)).max()
    if not (
        margins.floor_m > -_ROUNDING_M and margins.limits_rad > 0 and largest_acceleration < _LARGEST_ACCELERATION_M_S2
    ):
        raise TrialError(f"{player.name}: the movement drawn is more than a body can do; use another seed")
    return player.translate(np.array([0.0, player.side * max(CLEARANCE_M - margins.net_m, 0.0)]))


def volume_over(player: Player, duration_s: float) -> BodyVolume:
    """Return the volume of a player over a recording."""
    return capsules_of(player.movement.person, player.poses(sample_times(duration_s)), player.stature_m)


def sample_times(duration_s: float) -> Array:
    """Return the times (n,) [s] at which movements are checked: a recording and a little more at both ends."""
    return np.arange(-_CHECK_S, duration_s + _CHECK_S, _CHECK_S)
