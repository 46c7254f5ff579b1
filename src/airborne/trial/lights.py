"""[lights]: lights that were measured."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from airborne.rendering import Lamp, Lights
from airborne.trial.table import SettingsTable, Vector


class LampTable(SettingsTable):
    """A lamp: a point light, or with a direction and a half angle a spot light."""

    position_m: Vector
    intensity: float = Field(ge=0)  # irradiance of a matt surface facing it, as a share of its colour
    direction: Vector | None = None
    half_angle_deg: float | None = Field(None, gt=0, lt=90)

    @model_validator(mode="after")
    def _check_spot(self) -> LampTable:
        if (self.direction is None) != (self.half_angle_deg is None) or self.direction == [0, 0, 0]:
            raise ValueError("a spot light needs a direction with a length and half_angle_deg; a point light neither")
        return self

    def as_lamp(self) -> Lamp:
        """Return the lamp as the renderer takes it."""
        angle = None if self.half_angle_deg is None else float(np.radians(self.half_angle_deg))
        direction = None if self.direction is None else np.array(self.direction)
        return Lamp(np.array(self.position_m), self.intensity, direction, angle)


class LightsTable(SettingsTable):
    """Measured lights; without this table the light is unknown."""

    ambient: float = Field(ge=0)
    is_exact: bool = False  # rendered images: their light is exactly this, so that every method uses it
    lamp: list[LampTable] = []

    @property
    def lights(self) -> Lights:
        """The lights as the renderer takes them."""
        return Lights(self.ambient, tuple(table.as_lamp() for table in self.lamp))
