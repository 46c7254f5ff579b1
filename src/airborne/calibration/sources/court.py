"""A volleyball court with its net as named points of known positions (FIVB Official Rules, 1.1, 1.3, 2.1 to 2.5).

The world is that of the synthetic halls: origin on the floor in the middle of the court, x along the net to the right
as seen from the near half (y < 0), y across the net to the far half, z up. The court's 18 m × 9 m reach to the
**outer** edges of its lines, which are 5 cm wide; an attack line's rear edge is 3 m from the net's plane, so that the
line lies in front of it; the centre line lies half on either side.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

import numpy as np

from airborne.errors import CalibrationError
from airborne.types import Array

Net = Literal["men", "women"]

_LENGTH_M, _WIDTH_M, _ATTACK_M, _LINE_M = 18.0, 9.0, 3.0, 0.05  # FIVB rules of volleyball, 1.1, 1.4.1 and 1.3.1
_NET_M = {"men": 2.43, "women": 2.24}  # height in the middle
# the net's own height; antenna above the net; height of a post (FIVB 2.2, 2.4, 2.5.1)
_NET_DEPTH_M, _ANTENNA_M, _POST_M = 1.0, 0.80, 2.55
_NET_RANGE_M = (1.5, 3.0)  # of a net's height in play, children's and standing volleyball's among them
_NET_RISE_M = 0.01  # at the sidelines over the middle: between 0 and 2 cm are allowed (FIVB 2.1.2)
_POST_OUTSIDE_M = 0.75  # of the sideline: between 0.5 and 1 m are allowed (FIVB 2.5.1)

_PAINT_SD_M = 0.01  # of a court's lines
_RISE_SD_M = 0.006  # uniform over 0 to 2 cm
_BAND_SD_M = 0.02  # of a side band or an antenna along the net, and of an antenna across it
_POST_SD_M = 0.15  # uniform over 0.5 to 1 m
_CLICKED_BEST = re.compile(r"(corner_.*_outer|attack_.*_inner_rear|centre_.*_inner_.*|net_.*|antenna_.*)")
_CROSSWISE = (
    *(f"corner_{half}_{{}}_outer" for half in ("near", "far")),
    *(f"attack_{half}_{{}}_inner_rear" for half in ("near", "far")),
    *(f"centre_{{}}_inner_{half}" for half in ("near", "far")),
    *(f"net_{{}}_{end}" for end in ("top", "bottom")),
)  # points with a left and a right one, between which a line runs
_MOST_NAMES = 3  # suggested for a misspelt one


@dataclass(frozen=True, slots=True, eq=False)
class ScenePoint:
    """A point of a known position."""

    position_m: Array  # (3,) world [m]
    sd_m: Array  # (3,) standard deviation of each coordinate [m]


def court_points(net: Net | float = "men") -> dict[str, ScenePoint]:
    """Return every named point of a volleyball court, with a net for men, for women or of a height [m].

    near: y < 0, far: y > 0, left: x < 0, right: x > 0. Line crossings end in the edges that cross: `outer` and `inner`
    of the court's border, `front` (toward the net) and `rear` of an attack line, `near` and `far` of the centre line;
    `middle` is where the middles of two lines cross. Raises CalibrationError for a height that no net has.
    """
    height = _NET_M.get(net, np.nan) if isinstance(net, str) else float(net)
    if not _NET_RANGE_M[0] <= height <= _NET_RANGE_M[1]:
        raise CalibrationError(
            f'net = {net}: expected "men", "women" or a height in metres between {_NET_RANGE_M[0]} and '
            f"{_NET_RANGE_M[1]}"
        )
    points: dict[str, ScenePoint] = {}
    for side, sign_x in (("left", -1), ("right", 1)):
        for name, x, y in _floor_points(side):
            points[name] = _point((sign_x * x, y, 0.0), (_PAINT_SD_M, _PAINT_SD_M, _PAINT_SD_M))
        for name, position, sd in _net_points(side, height):
            points[name] = _point((sign_x * position[0], *position[1:]), sd)
    return points


def survey_points(net: Net | float) -> dict[str, Array]:
    """Return the points of a court that are clicked best, each once: name -> (3,) [m]."""
    return {name: point.position_m for name, point in court_points(net).items() if _CLICKED_BEST.fullmatch(name)}


def court_lines(points: Mapping[str, Array]) -> list[Array]:
    """Return the lines of a court, and of its net, between those of its points that are there: each (2, 3) [m]."""
    pairs = [(f"corner_near_{side}_outer", f"corner_far_{side}_outer") for side in ("left", "right")]
    pairs += [(name.format("left"), name.format("right")) for name in _CROSSWISE]
    return [np.stack([points[a], points[b]]) for a, b in pairs if a in points and b in points]


def closest_names(name: str, names: dict[str, ScenePoint]) -> str:
    """Return the names most like an unknown one, for an error message."""
    return ", ".join(get_close_matches(name.lower(), names, n=_MOST_NAMES, cutoff=0.0))


def _floor_points(side: str) -> Iterator[tuple[str, float, float]]:
    outer, inner, middle = _WIDTH_M / 2, _WIDTH_M / 2 - _LINE_M, (_WIDTH_M - _LINE_M) / 2
    for half, sign in (("near", -1), ("far", 1)):
        end = _LENGTH_M / 2
        yield f"corner_{half}_{side}_outer", outer, sign * end
        yield f"corner_{half}_{side}_inner", inner, sign * (end - _LINE_M)
        yield f"corner_{half}_{side}_middle", middle, sign * (end - _LINE_M / 2)
        yield f"attack_{half}_{side}_outer_rear", outer, sign * _ATTACK_M
        yield f"attack_{half}_{side}_inner_rear", inner, sign * _ATTACK_M
        yield f"attack_{half}_{side}_inner_front", inner, sign * (_ATTACK_M - _LINE_M)
        yield f"attack_{half}_{side}_middle", middle, sign * (_ATTACK_M - _LINE_M / 2)
        yield f"centre_{side}_inner_{half}", inner, sign * _LINE_M / 2
    yield f"centre_{side}_outer", outer, 0.0
    yield f"centre_{side}_middle", middle, 0.0


def _net_points(
    side: str, height: float
) -> Iterator[tuple[str, tuple[float, float, float], tuple[float, float, float]]]:
    x, top = _WIDTH_M / 2, height + _NET_RISE_M
    band = (_BAND_SD_M, _PAINT_SD_M, _RISE_SD_M)
    antenna = (_BAND_SD_M, _BAND_SD_M, _BAND_SD_M)
    yield f"net_{side}_top", (x, 0.0, top), band
    yield f"net_{side}_bottom", (x, 0.0, top - _NET_DEPTH_M), (_BAND_SD_M, 2 * _BAND_SD_M, _BAND_SD_M)
    yield f"antenna_{side}_top", (x, 0.0, top + _ANTENNA_M), antenna
    yield f"post_{side}_top", (x + _POST_OUTSIDE_M, 0.0, _POST_M), (_POST_SD_M, 2 * _BAND_SD_M, _BAND_SD_M)


def _point(position: tuple[float, ...], sd: tuple[float, ...]) -> ScenePoint:
    return ScenePoint(np.array(position), np.array(sd))
