"""The table of a trial file that says where a player starts, and what all its tables share."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from airborne.body.legs import LEG_POINTS, Legs
from airborne.errors import BodyError

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]

STRICT = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)  # of every table
FEET = ("foot_left", "foot_right")
FARTHEST_M = 100.0  # no court is larger
MOST_UNDER_FLOOR_M = 0.3  # what a calibration's floor may be off


def _fit_for_tables(name: str) -> str:
    if not name:
        raise ValueError("must not be empty")
    if set(name) & set(',"\r\n'):
        raise ValueError("must not hold a comma, a quote or a line's end")
    return name


class PlayerTable(BaseModel):
    """Where a player is at the first frame; one with a torso only is a bystander."""

    model_config = STRICT

    name: Annotated[str, AfterValidator(_fit_for_tables)]
    joints_m: dict[str, Vector]

    @model_validator(mode="after")
    def _known_points(self) -> PlayerTable:
        known = ("torso", *LEG_POINTS, *FEET)
        unknown = [name for name in self.joints_m if name not in known]
        missing = [name for name in known[:-2] if name not in self.joints_m]
        if unknown:
            raise ValueError(f"player '{self.name}': no point {', '.join(unknown)}; there are: {', '.join(known)}")
        if "torso" in missing or (self.has_legs and missing):
            raise ValueError(
                f"player '{self.name}': joints_m has no {', '.join(missing)}; give all of {', '.join(known[:-2])}, "
                "or the torso alone of a bystander"
            )
        far = [name for name, place in self.joints_m.items() if max(map(abs, place)) > FARTHEST_M]
        if far:
            raise ValueError(f"player '{self.name}': {far[0]} lies over {FARTHEST_M:g} m away; give metres")
        if self.has_legs:
            self._measure()
        return self

    def _measure(self) -> None:
        points = np.array([self.joints_m[name] for name in LEG_POINTS])
        if points[:2, 2].min() < points[4:, 2].max():
            raise ValueError(f"player '{self.name}': a hip lies lower than an ankle; were they exchanged?")
        under_m = -float(points[:, 2].min())
        if under_m > MOST_UNDER_FLOOR_M:
            raise ValueError(f"player '{self.name}': a joint lies {under_m:.2f} m under the floor, which must be z = 0")
        try:
            Legs.from_points(np.array(self.joints_m["torso"]), points)
        except BodyError as error:
            raise ValueError(f"player '{self.name}': {error}") from error

    @property
    def has_legs(self) -> bool:
        """Whether the player is tracked, and no bystander."""
        return set(self.joints_m) != {"torso"}
