"""[body]: whose motion is tracked."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from airborne.body import BodyModel
from airborne.body.anthropometry import require_athlete
from airborne.body.density import doubt_build, doubt_mass
from airborne.errors import BodyError
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
        if self.preset == "human18" and None in sizes:
            missing = [name for name in ("stature_m", "mass_kg") if getattr(self, name) is None]
            raise ValueError(f'preset = "human18" needs stature_m and mass_kg; add {" and ".join(missing)}')
        if self.preset != "human18" and any(size is not None for size in sizes):
            raise ValueError('stature_m and mass_kg go with preset = "human18" alone; remove them')
        if self.stature_m is not None and self.mass_kg is not None:
            try:
                require_athlete(self.stature_m, self.mass_kg)
            except BodyError as error:
                raise ValueError(str(error)) from None
        return self

    def doubts(self, model: BodyModel) -> list[str]:
        """Return what is odd about the mass of its body, or of what has been fitted from it: sentences."""
        if self.stature_m is None or self.mass_kg is None:
            return [*doubt_mass(model)]
        return [*doubt_build(self.stature_m, self.mass_kg), *doubt_mass(model)]

    @property
    def is_preset(self) -> bool:
        """Whether its proportions are an average person's, not measured or drawn."""
        return self.preset is not None

    @property
    def source_file(self) -> str | None:
        """The file that defines the body, if there is one."""
        return self.file or self.measurements
