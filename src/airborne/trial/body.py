"""[body]: whose motion is tracked."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from airborne.body import BodyModel
from airborne.body.density import doubt_build, doubt_mass
from airborne.io.names import CheckedPath
from airborne.trial.table import SettingsTable


class BodyTable(SettingsTable):
    """Which body: a body file, a person of given stature and mass, a measured person, or players' legs."""

    file: CheckedPath | None = None
    preset: Literal["human18", "legs"] | None = None
    stature_m: float | None = Field(None, gt=0)
    mass_kg: float | None = Field(None, gt=0)
    measurements: CheckedPath | None = None

    @model_validator(mode="after")
    def _check_body(self) -> BodyTable:
        if sum(value is not None for value in (self.file, self.preset, self.measurements)) != 1:
            raise ValueError(
                'give file = "...", preset = "human18" or measurements = "...", one of them; '
                'of several players preset = "legs"'
            )
        sizes = (self.stature_m, self.mass_kg)
        if self.preset == "legs" and any(size is not None for size in sizes):
            raise ValueError('preset = "legs" takes no stature_m and no mass_kg; remove them')
        if any(size is None for size in sizes) if self.preset == "human18" else any(size is not None for size in sizes):
            raise ValueError("stature_m and mass_kg go with a preset, both of them, and with nothing else")
        return self

    def doubts(self, model: BodyModel) -> list[str]:
        """Return what is odd about the mass of its body, or of what has been fitted from it: sentences."""
        if self.stature_m is None or self.mass_kg is None:
            return list(doubt_mass(model))
        return [*doubt_build(self.stature_m, self.mass_kg), *doubt_mass(model)]

    @property
    def source_file(self) -> str | None:
        """The file that defines the body, if there is one."""
        return self.file or self.measurements
