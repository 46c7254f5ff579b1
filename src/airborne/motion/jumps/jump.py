"""A jump: measurements with their intervals, in metres and seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.types import Array


class Measurement(NamedTuple):
    """A number with its 95 % interval; all NaN where unknown."""

    value: float
    low: float
    high: float

    @classmethod
    def from_draws(cls, draws: Array | None) -> Measurement:
        """Reduce posterior draws to their median and central 95 % interval."""
        if draws is None or not np.isfinite(draws).all():
            return UNKNOWN
        low, value, high = np.quantile(draws, [0.025, 0.5, 0.975]).tolist()
        return cls(value, low, high)


UNKNOWN = Measurement(np.nan, np.nan, np.nan)
# of the variances: above it a flight is no fall as tracked. Chosen by what `blocker` has: right recordings 1 (32 jumps
# of them), a clock 0.1 s off 2, every tenth image lost in all cameras 3.9, a wrong frame rate 8 to 11, mixed videos 12
_NOISY = 3.0
# by which feet rise more than hips in a flight that is no fall. Chosen on synthetic blocks 41 to 44, whole and with a
# camera moved, late or at a wrong frame rate, where it is at most 0.05; block_jump then has 0.05, with a camera moved
# half-way 0.67
_MOST_TUCK_M = 0.3
_FOLDED_LEGS_M = 0.62  # and in any, by anatomy: thighs and shanks of 0.42 m, bent by 150 degrees, a knee's whole range


def is_no_fall(noise_scale: float) -> bool:
    """Say whether a flight differs from a free fall far more than the stated errors explain."""
    return noise_scale > _NOISY


def are_legs_lost(noise_scale: float, tuck_m: float) -> bool:
    """Say whether legs went astray in a flight: the feet rose more than knees can bend, or far more in no fall."""
    return tuck_m > _FOLDED_LEGS_M or (is_no_fall(noise_scale) and tuck_m > _MOST_TUCK_M)


@dataclass(frozen=True, slots=True, kw_only=True)
class StandingPosture:
    """Heights of hips and ankles while the player stands, and their source."""

    hips_m: Measurement  # height of the mid-hips over the floor
    ankles_m: Measurement
    source: str  # "stance": frames of a quiet upright stance; "lengths": thigh + shank, with the ankles on the floor
    frames: tuple[int, int] | None  # first and last of the stance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Jump:
    """One flight of one player. Heights are rises in metres, times in seconds; what is not observed is NaN.

    The four definitions of jump height do not measure the same thing: see docs/explanation/jumps.md before comparing.
    """

    player: str
    number: int  # of this player's jumps, from 1
    status: str  # "whole", "no take-off", "no landing" or "neither": which events the recording shows
    n_lost: int  # frames of the flight in which a hip or an ankle is not known
    n_uncertain: int  # frames of the flight in which the tracker calls a hip, knee or ankle uncertain
    n_hips_uncertain: int  # and in which it calls a hip uncertain
    takeoff_s: Measurement
    landing_s: Measurement
    takeoff_frame: Measurement  # the same in frames, with fractions
    landing_frame: Measurement
    flight_s: Measurement
    foot_height_m: Measurement  # mean of both ankles: peak minus standing
    hip_height_m: Measurement  # mid-hips: peak minus standing
    tuck_m: Measurement  # how much more the feet rose than the hips
    flight_time_height_m: Measurement  # g T^2 / 8
    takeoff_speed_height_m: Measurement  # v^2 / 2g of the centre of mass of hips and legs at take-off
    hip_rise_m: Measurement  # mid-hips: peak minus take-off
    takeoff_speed_m_s: Measurement  # vertical, of that centre of mass
    block_s: Measurement  # how long the hips are more than `block_level_m` over their standing height
    block_level_m: float
    drift_m: Measurement  # horizontal distance of the mid-ankles from take-off to landing
    takeoff_position_m: tuple[Measurement, Measurement]  # x and y of the mid-ankles
    landing_position_m: tuple[Measurement, Measurement]
    hip_peak_speed_m_s: Measurement  # from 0.3 s before take-off to landing; foot: the faster ankle
    foot_peak_speed_m_s: Measurement
    reach_m: Measurement  # highest wrist over the floor; NaN where wrists are not tracked
    standing: StandingPosture
    noise_scale: float  # factor applied to the stated variances, above 1 where the flight shows more noise
    path_frames: NDArray[np.int64]  # (n,) the frames of the flight
    path_s: Array  # (n,)
    foot_paths_m: Array  # (n, 2, 3) left and right ankle, as tracked
