"""The fall of players in flight as a measurement of the world's size and of the frame rate: 9.81 m/s2."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from airborne.constants import ALARM_SDS, GRAVITY_M_S2
from airborne.motion.jumps.events import find_flights, measure_fall
from airborne.motion.jumps.heights import LEAST_RATE_HZ
from airborne.motion.jumps.leg_track import extract_legs
from airborne.motion.players import PlayersMotion
from airborne.tracking.self_check.path import alarm

# how legs and hips, weighed as `LegTrack` does, fall, alike in all flights, as players move arms and trunk alike.
# Chosen between the truths of synthetic blocks 5, 11, 41 and 42, 9.55 to 9.88 m/s2 (spikers beside at 10.2), and a
# jumper whose arms and trunk keep still, 10.55
_EXPECTED_M_S2, _LIMBS_SD_M_S2 = 10.05, 0.25


class Gravity(NamedTuple):
    """The downward acceleration of the players in flight, over all flights."""

    value_m_s2: float
    sd_m_s2: float

    @property
    def is_wrong(self) -> bool:
        """Whether it clearly differs from what a right one is, whatever arms and trunk do."""
        return abs(self.value_m_s2 - _EXPECTED_M_S2) > ALARM_SDS * self.sd_m_s2

    @property
    def sentence(self) -> str:
        """Say what a wrong one tells."""
        ratio = self.value_m_s2 / GRAVITY_M_S2
        return (
            f"in flight the players fall at {self.value_m_s2:.1f} ± {self.sd_m_s2:.1f} m/s² instead of "
            f"{GRAVITY_M_S2:.2f}: the world is {abs(ratio - 1):.0%} too {'large' if ratio > 1 else 'small'}, or the "
            f"stated frame rate is {np.sqrt(ratio):.2f} times that at which it was filmed; no joint is called tracked. "
            "Check the lengths of the calibration and the frame rate"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what `self_check` in summary.json holds of a wrong one: an alarm, its value above 9.81 m/s2."""
        value = self.value_m_s2 - GRAVITY_M_S2
        return alarm("fall", "gravity_m_s2", value=value, sd=self.sd_m_s2, sentence=self.sentence)


def find_wrong_gravity(motion: PlayersMotion) -> Gravity | None:
    """Measure how fast the players fall where that is clearly wrong; None elsewhere."""
    found = measure_gravity(motion)
    return found if found is not None and found.is_wrong else None


def measure_gravity(motion: PlayersMotion) -> Gravity | None:
    """Measure how fast the players fall, over all flights; None without a flight, and below LEAST_RATE_HZ."""
    if motion.rate < LEAST_RATE_HZ:
        return None
    values, sds = np.array(list(_falls(motion))).reshape(-1, 2).T
    if not len(values):
        return None
    noise_sd_m_s2 = float(np.sum(sds**-2) ** -0.5)
    return Gravity(float(np.average(values, weights=sds**-2)), float(np.hypot(noise_sd_m_s2, _LIMBS_SD_M_S2)))


def _falls(motion: PlayersMotion) -> Iterator[tuple[float, float]]:
    """Yield the downward acceleration in each flight of a player who is tracked somewhere, and its noise's sd."""
    for player in motion.players:
        track = extract_legs(motion, player)
        for rows in find_flights(track) if track.is_measured.any() else ():
            fall = measure_fall(track, rows)
            yield -fall.acceleration_m_s2, fall.sd_m_s2 * float(np.sqrt(max(fall.noise, 1.0)))
