"""A jumper by closed formulas: stands, crouches, pushes off, flies on a parabola, lands; every truth is exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.body.legs import LEG_POINTS
from airborne.motion.free_fall import PLAYER_NOISE
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.jumps.leg_track import LegTrack, extract_legs
from airborne.motion.players import PlayersMotion

G = 9.81
FLAT_M, BALL_M, HEEL_M, TOUCH_M, LEG_M, SHARE = 0.10, 0.04, 0.10, 0.07, 0.95, 0.985


@dataclass(frozen=True, kw_only=True)
class Jumper:
    """A jump of one person; the default rises 0.45 m."""

    takeoff_s: float = 1.013
    speed_m_s: float = float(np.sqrt(2 * G * 0.45))
    depth_m: float = 0.35  # of the crouch
    position_m: tuple[float, float] = (0.0, 0.0)
    duration_s: float = 2.5
    rate: float = 60.0

    @property
    def rise_m(self) -> float:
        return self.speed_m_s**2 / (2 * G)

    @property
    def flight_s(self) -> float:
        drop = HEEL_M - TOUCH_M
        return (self.speed_m_s + np.sqrt(self.speed_m_s**2 + 2 * G * drop)) / G

    @property
    def landing_s(self) -> float:
        return self.takeoff_s + self.flight_s

    @property
    def time_s(self):
        return np.arange(round(self.duration_s * self.rate)) / self.rate

    def points(self):
        """Hips, knees, ankles, balls of the feet over time: (n, 8, 3)."""
        t = self.time_s
        into = np.clip(t - self.takeoff_s, 0, self.flight_s)
        rise = self.speed_m_s * into - G / 2 * into**2
        touch_speed = G * self.flight_s - self.speed_m_s
        before, after = np.maximum(self.takeoff_s - t, 0), np.maximum(t - self.landing_s, 0)
        heel = np.where(t < self.landing_s, HEEL_M * np.exp(-before * self.speed_m_s / HEEL_M), TOUCH_M)
        heel = np.where(t > self.landing_s, TOUCH_M * np.exp(-after * touch_speed / TOUCH_M), heel)
        flying = (t > self.takeoff_s) & (t <= self.landing_s)
        ankle = FLAT_M + np.where(flying, HEEL_M + rise, heel)
        ball = BALL_M + np.where(flying, 0.02 + rise * (0.02 + self.rise_m) / self.rise_m, 0.0)
        hip = FLAT_M + SHARE * LEG_M + HEEL_M + rise
        hip = hip - self._drop_m(before, self.speed_m_s) - self._drop_m(after, touch_speed)
        hip = np.where(before > 0.9, FLAT_M + SHARE * LEG_M, hip)
        return self._legs(hip, ankle, ball)

    def _drop_m(self, into_contact, speed):
        """How far the hips are below where they were at the event; from the lowest point they rise to the stance."""
        push = speed**2 / (2 * self.depth_m)
        turn = speed / push
        down = speed * into_contact - push / 2 * into_contact**2
        share = np.clip((into_contact - turn) / (0.9 - turn), 0, 1)
        eased = 10 * share**3 - 15 * share**4 + 6 * share**5
        return np.where(into_contact < turn, down, self.depth_m + (HEEL_M - self.depth_m) * eased)

    def _legs(self, hip, ankle, ball):
        n = len(hip)
        points = np.zeros((n, 8, 3))
        for k, x in enumerate((-0.1, 0.1)):
            apart = np.minimum(hip - ankle, LEG_M)
            forward = np.sqrt((LEG_M / 2) ** 2 - (apart / 2) ** 2)
            points[:, k] = np.column_stack([np.full(n, x), np.zeros(n), hip])
            points[:, 2 + k] = np.column_stack([np.full(n, x), forward, (hip + ankle) / 2])
            points[:, 4 + k] = np.column_stack([np.full(n, x), np.zeros(n), ankle])
            points[:, 6 + k] = np.column_stack([np.full(n, x), np.full(n, 0.15), ball])
        points[..., :2] += self.position_m
        return points


def players_motion(time_s, points, *, sd_m=1e-3, joints=LEG_POINTS, players=("one",)):
    """Wrap points (n, players, joints, 3) as a motion with a stated standard deviation of sd_m."""
    n, p, j = points.shape[:3]
    return PlayersMotion(
        index=np.arange(n),
        time_s=np.asarray(time_s),
        rate=60.0,
        players=tuple(players),
        joints=tuple(joints),
        points=points,
        covariance=np.broadcast_to(sd_m**2 * np.eye(3), (n, p, j, 3, 3)),
        joint_status=np.full((n, p, j), "tracked"),
        score=np.zeros((n, p)),
        n_views=np.full((n, p), 3),
    )


def first_legs(motion) -> LegTrack:
    """The legs of a motion's first player."""
    return extract_legs(motion, motion.players[0])


def motion_of(jumper, *, sd_m=1e-3, rng=None, feet=False):
    """Return a jumper's motion, with noise of sd_m distributed like that of the players' trackers if rng is given."""
    joints = (*LEG_POINTS, "foot_left", "foot_right") if feet else LEG_POINTS
    points = jumper.points()[:, None, : len(joints)]
    if rng is not None:
        points = points + sd_m * noise(rng, points.shape, jumper.rate)
    return players_motion(jumper.time_s, points, sd_m=sd_m, joints=joints)


def noise(rng, shape, rate=60.0):
    """Unit noise (n, ...), in part white, else correlated, as `PLAYER_NOISE` has it."""
    keep = np.exp(-1 / rate / PLAYER_NOISE.correlation_time_s)
    steps = rng.standard_normal(shape)
    slow = np.empty(shape)
    slow[0] = steps[0]
    for k in range(1, shape[0]):
        slow[k] = keep * slow[k - 1] + np.sqrt(1 - keep**2) * steps[k]
    white = PLAYER_NOISE.white_share
    return np.sqrt(white) * rng.standard_normal(shape) + np.sqrt(1 - white) * slow


def only(motion):
    """Return the one jump of a motion."""
    (jump,) = measure_jumps(motion)
    return jump
