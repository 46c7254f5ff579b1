"""What lights a body: an even light from everywhere and any number of lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.errors import TrialError
from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Lamp:
    """A point light; with a direction and a half angle, a spot light with a sharp edge. It does not fade with distance.

    A matt surface that faces the lamp gets `intensity` times its colour.
    """

    position_m: Array  # (3,) world [m]
    intensity: float
    direction: Array | None = None  # (3,) world, the spot's axis away from the lamp, any length
    half_angle_rad: float | None = None

    def __post_init__(self) -> None:
        if (self.direction is None) != (self.half_angle_rad is None):
            raise TrialError(
                "a lamp has only one of direction and half angle; a spot light needs both, a point light neither"
            )
        if self.direction is not None and not np.linalg.norm(self.direction) > 0:
            raise TrialError("a spot light's direction has no length; give the way it shines, as x, y, z")


@dataclass(frozen=True, slots=True, eq=False)
class Lights:
    """A body's light: colour times `ambient` plus what each lamp adds, in the same units as the sRGB values."""

    ambient: float
    lamps: tuple[Lamp, ...] = ()


FLAT = Lights(ambient=1.0)  # every part in its own flat colour
