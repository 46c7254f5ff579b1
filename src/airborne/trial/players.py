"""[[start.player]]: where a player is at the first frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from pydantic import model_validator

from airborne.body.legs import LEG_POINTS, Legs
from airborne.errors import BodyError
from airborne.io.names import CheckedPath, ColumnName
from airborne.tracking.players import PlayerStart
from airborne.trial.pose_forms import FARTHEST_M
from airborne.trial.table import ClickTable, SettingsTable, Vector

_FEET = ("foot_left", "foot_right")
_MOST_UNDER_FLOOR_M = 0.3  # by how much a calibration's floor may be off
# chosen: horizontal over vertical distance of hips and ankles; no start of a block leans by 45 degrees
_MOST_LEANING = 2.0
# chosen: three sds of the mean of both knees or feet, of joints that are 20 mm off each way
_MOST_BEHIND_M = 0.05
_MOST_TO_TORSO_M = 0.5  # chosen: twice as far as the midpoint of hips and shoulders lies from the hips


class PlayerTable(SettingsTable):
    """A player's joints at the first frame, in metres or clicked; a player with a torso only is a bystander."""

    name: ColumnName
    joints_m: dict[str, Vector] | CheckedPath | None = None  # point -> position, or a table of them
    points_px: ClickTable | CheckedPath | None = None  # point -> camera -> u, v, or a table of clicked points

    @model_validator(mode="after")
    def _check_points(self) -> PlayerTable:
        if (self.joints_m is None) == (self.points_px is None):
            raise ValueError("give joints_m or points_px, one of them")
        if isinstance(self.joints_m, dict):
            start_of(self.name, self.joints_m)
        elif isinstance(self.points_px, dict):
            check_point_names(self.points_px)
        return self

    @property
    def source_files(self) -> list[str]:
        """The files that define it."""
        return [name for name in (self.joints_m, self.points_px) if isinstance(name, str)]

    @property
    def is_bystander(self) -> bool:
        """Whether the trial file itself says that only the torso is given."""
        points = self.joints_m if self.points_px is None else self.points_px
        return isinstance(points, dict) and set(points) == {"torso"}


def start_of(name: str, joints_m: Mapping[str, Sequence[float]]) -> PlayerStart:
    """Return a player's start of joints in metres; raises ValueError for those that cannot be a player's."""
    check_point_names(joints_m)
    start = PlayerStart(name=name, joints_m={joint: np.array(point, float) for joint, point in joints_m.items()})
    far = [joint for joint, point in start.joints_m.items() if np.abs(point).max() > FARTHEST_M]
    if far:
        at = start.joints_m[far[0]].tolist()
        raise ValueError(f"{far[0]} = {at} lies over {FARTHEST_M:g} m away; give metres")
    if start.has_legs:
        _check_legs(start)
    return start


def check_point_names(points: Iterable[str]) -> None:
    """Raise ValueError for a point that a player does not have, and where one is missing."""
    given, names = set(points), ("torso", *LEG_POINTS, *_FEET)
    unknown = [point for point in points if point not in names]
    missing = [point for point in names[:-2] if point not in given]
    if unknown:
        raise ValueError(f"no point {', '.join(unknown)}; there are: {', '.join(names)}")
    if "torso" in missing or (given != {"torso"} and missing):
        raise ValueError(
            f"joints_m has no {', '.join(missing)}; give all of {', '.join(names[:-2])}, "
            "or the torso alone of a bystander"
        )


def _check_legs(start: PlayerStart) -> None:
    points = np.array([start.joints_m[point] for point in LEG_POINTS])
    across, up_m = (
        np.abs(points[:2].mean(axis=0) - points[4:].mean(axis=0))[:2],
        points[:2, 2].mean() - points[4:, 2].mean(),
    )
    if across.max() > _MOST_LEANING * abs(up_m):
        raise ValueError(
            f"the legs lie along {'xy'[int(across.argmax())]}, not along z: were axes exchanged? z must point up"
        )
    if points[:2, 2].min() < points[4:, 2].max():
        raise ValueError("a hip lies lower than an ankle; were they exchanged?")
    _check_facing(start)
    to_torso_m = float(np.linalg.norm(start.joints_m["torso"] - points[:2].mean(axis=0)))
    if to_torso_m > _MOST_TO_TORSO_M:
        raise ValueError(
            f"the torso, midway between hips and shoulders, lies {to_torso_m:.2f} m from the hips; is it another's?"
        )
    under_m = -float(points[:, 2].min())
    if under_m > _MOST_UNDER_FLOOR_M:
        raise ValueError(f"a joint lies {under_m:.2f} m under the floor, which must be z = 0")
    try:
        Legs.from_points(np.array(start.joints_m["torso"]), points)
    except BodyError as error:
        raise ValueError(str(error)) from error


def _check_facing(start: PlayerStart) -> None:
    """Raise ValueError where knees bend or feet point backward, seen from the hips."""
    joints_m = start.joints_m
    forward = np.cross(joints_m["hip_left"] - joints_m["hip_right"], [0.0, 0.0, 1.0])
    forward /= max(np.linalg.norm(forward), 1e-9)
    bends, feet = [], []
    for side in ("left", "right"):
        hip, knee, ankle = (joints_m[f"{part}_{side}"] for part in ("hip", "knee", "ankle"))
        along = (ankle - hip) / max(np.linalg.norm(ankle - hip), 1e-9)
        bends.append((knee - hip - (knee - hip) @ along * along) @ forward)
        if f"foot_{side}" in joints_m:
            feet.append((joints_m[f"foot_{side}"] - ankle) @ forward)
    for what, distances in (("the knees bend", bends), ("the feet point", feet)):
        behind_m = -float(np.mean(distances or [0.0]))
        if behind_m > _MOST_BEHIND_M:
            raise ValueError(
                f"{what} {100 * behind_m:.0f} cm backward; were left and right exchanged, at the hips or everywhere?"
            )
