"""What a jump is: numbers with their intervals, in metres and seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


class Measured(NamedTuple):
    """A number with its 95 % interval; all NaN where nothing can be said."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, draws: Array | None) -> Measured:
        """Reduce draws from a posterior to their median and the interval of the middle 95 %."""
        if draws is None or not np.isfinite(draws).all():
            return UNKNOWN
        low, value, high = np.quantile(draws, [0.025, 0.5, 0.975]).tolist()
        return cls(value, low, high)


UNKNOWN = Measured(np.nan, np.nan, np.nan)


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """Where the hips and ankles are while the player stands, and how that is known."""

    hips_m: Measured  # height of their middle over the floor
    ankles_m: Measured
    source: str  # "stance": frames of a quiet straight stance; "lengths": thigh + shank, and the ankles on the floor
    frames: tuple[int, int] | None  # first and last of the stance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Jump:
    """One flight of one player. Heights are rises in metres, times in seconds; what is not seen is NaN.

    The four definitions of jump height do not measure the same thing: see docs/explanation/jumps.md before comparing.
    """

    player: str
    number: int  # of this player's jumps, from 1
    status: str  # "whole", "no take-off", "no landing" or "neither": which events the recording shows
    n_lost: int  # frames of the flight in which a hip or an ankle is not known
    n_uncertain: int  # frames of the flight that the tracker calls uncertain
    takeoff_s: Measured
    landing_s: Measured
    takeoff_frame: Measured  # the same in frames, with their fractions
    landing_frame: Measured
    flight_s: Measured
    foot_height_m: Measured  # mean of both ankles: peak minus standing
    hip_height_m: Measured  # middle of the hips: peak minus standing
    flight_time_height_m: Measured  # g T^2 / 8
    takeoff_speed_height_m: Measured  # v^2 / 2g of the centre of mass of hips and legs at take-off
    hip_rise_m: Measured  # middle of the hips: peak minus where it is at take-off
    takeoff_speed_m_s: Measured  # upward, of that centre of mass
    block_s: Measured  # how long the hips are more than `block_level_m` over where they stand
    block_level_m: float
    drift_m: Measured  # horizontal distance of the ankles' middle from take-off to landing
    takeoff_place_m: tuple[Measured, Measured]  # x and y of the ankles' middle
    landing_place_m: tuple[Measured, Measured]
    hip_peak_speed_m_s: Measured  # from 0.3 s before take-off to landing; foot: the faster ankle
    foot_peak_speed_m_s: Measured
    reach_m: Measured  # highest wrist over the floor; NaN where wrists are not tracked
    standing: Standing
    noise_scale: float  # the stated variances were multiplied by this, as the flight shows more noise than they say
    path_frames: NDArray[np.int64]  # (n,) the frames of the flight
    path_s: Array  # (n,)
    foot_paths_m: Array  # (n, 2, 3) left and right ankle, as tracked
