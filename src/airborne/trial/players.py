"""[[start.player]]: where a player is at the first frame."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from airborne.body.legs import LEG_POINTS, Legs
from airborne.errors import BodyError
from airborne.io.names import ColumnName
from airborne.tracking.players import PlayerStart
from airborne.trial.table import SettingsTable, Vector

_FEET = ("foot_left", "foot_right")
_FARTHEST_M = 100.0  # no court is larger
_MOST_UNDER_FLOOR_M = 0.3  # by how much a calibration's floor may be off


class PlayerTable(SettingsTable):
    """A player's joints at the first frame; a player with a torso only is a bystander."""

    name: ColumnName
    joints_m: dict[str, Vector]

    @model_validator(mode="after")
    def _check_points(self) -> PlayerTable:
        names = ("torso", *LEG_POINTS, *_FEET)
        unknown = [name for name in self.joints_m if name not in names]
        missing = [name for name in names[:-2] if name not in self.joints_m]
        if unknown:
            raise ValueError(f"player '{self.name}': no point {', '.join(unknown)}; there are: {', '.join(names)}")
        if "torso" in missing or (self.has_legs and missing):
            raise ValueError(
                f"player '{self.name}': joints_m has no {', '.join(missing)}; give all of {', '.join(names[:-2])}, "
                "or the torso alone of a bystander"
            )
        far = [name for name, point in self.joints_m.items() if max(map(abs, point)) > _FARTHEST_M]
        if far:
            raise ValueError(f"player '{self.name}': {far[0]} lies over {_FARTHEST_M:g} m away; give metres")
        if self.has_legs:
            self._check_legs()
        return self

    def _check_legs(self) -> None:
        points = np.array([self.joints_m[name] for name in LEG_POINTS])
        if points[:2, 2].min() < points[4:, 2].max():
            raise ValueError(f"player '{self.name}': a hip lies lower than an ankle; were they exchanged?")
        under_m = -float(points[:, 2].min())
        if under_m > _MOST_UNDER_FLOOR_M:
            raise ValueError(f"player '{self.name}': a joint lies {under_m:.2f} m under the floor, which must be z = 0")
        try:
            Legs.from_points(np.array(self.joints_m["torso"]), points)
        except BodyError as error:
            raise ValueError(f"player '{self.name}': {error}") from error

    @property
    def has_legs(self) -> bool:
        """Whether the player is tracked, not a bystander."""
        return set(self.joints_m) != {"torso"}

    @property
    def start(self) -> PlayerStart:
        """The start as the trackers take it."""
        return PlayerStart(name=self.name, joints_m={name: np.array(point) for name, point in self.joints_m.items()})
