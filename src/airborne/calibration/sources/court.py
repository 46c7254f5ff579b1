"""A volleyball court with its net as points of known places, by name (FIVB Official Rules, 1.1, 1.3, 2.1 to 2.5).

The world is that of the synthetic halls: origin on the floor in the middle of the court, x along the net to the right
as seen from the near half (y < 0), y across the net to the far half, z up. The court's 18 m × 9 m reach to the
**outer** edges of its lines, which are 5 cm wide; an attack line's rear edge is 3 m from the net's plane, so that the
line lies in front of it; the centre line lies half on either side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.errors import CalibrationError

Array = NDArray[np.floating]
Net = Literal["men", "women"]

LENGTH_M, WIDTH_M, ATTACK_M, LINE_M = 18.0, 9.0, 3.0, 0.05
NET_M = {"men": 2.43, "women": 2.24}  # height in the middle
NET_DEPTH_M, ANTENNA_M, POST_M = 1.0, 0.80, 2.55  # the net's own height; antenna above the net; height of a post
NET_RANGE_M = (1.5, 3.0)  # of a net's height in play, children's and standing volleyball's among them
NET_RISE_M = 0.01  # at the sidelines over the middle: between 0 and 2 cm are allowed
POST_OUTSIDE_M = 0.75  # of the sideline: between 0.5 and 1 m are allowed

PAINT_SD_M = 0.01  # how exactly a court is laid
RISE_SD_M = 0.006  # of 0 to 2 cm, all alike likely
BAND_SD_M = 0.02  # where a side band or an antenna hangs along the net, and how far antennas stand off it
POST_SD_M = 0.15  # of 0.5 to 1 m, all alike likely
MOST_NAMES = 3


@dataclass(frozen=True, slots=True, eq=False)
class ScenePoint:
    """A point of a known place."""

    place_m: Array  # (3,) world [m]
    sd_m: Array  # (3,) how exactly each coordinate is known [m]


def court_points(net: Net | float = "men") -> dict[str, ScenePoint]:
    """Return every named point of a volleyball court, with a net for men, for women or of a height [m].

    near: y < 0, far: y > 0, left: x < 0, right: x > 0. Line crossings end in the edges that cross: `outer` and `inner`
    of the court's border, `front` (toward the net) and `rear` of an attack line, `near` and `far` of the centre line;
    `middle` is where the middles of two lines cross. Raises CalibrationError for a height that no net has.
    """
    height = NET_M.get(net, np.nan) if isinstance(net, str) else float(net)
    if not NET_RANGE_M[0] <= height <= NET_RANGE_M[1]:
        raise CalibrationError(
            f'net = {net}: expected "men", "women" or a height in metres between {NET_RANGE_M[0]} and {NET_RANGE_M[1]}'
        )
    found: dict[str, ScenePoint] = {}
    for side, sign_x in (("left", -1), ("right", 1)):
        for name, x, y in _floor(side):
            found[name] = _point((sign_x * x, y, 0.0), (PAINT_SD_M, PAINT_SD_M, PAINT_SD_M))
        for name, place, sd in _above(side, height):
            found[name] = _point((sign_x * place[0], *place[1:]), sd)
    return found


def nearest_names(name: str, known: dict[str, ScenePoint]) -> str:
    """Return the names most like one that is not known, for an error."""
    return ", ".join(get_close_matches(name.lower(), known, n=MOST_NAMES, cutoff=0.0))


def _floor(side: str) -> Iterator[tuple[str, float, float]]:
    outer, inner, middle = WIDTH_M / 2, WIDTH_M / 2 - LINE_M, (WIDTH_M - LINE_M) / 2
    for half, sign in (("near", -1), ("far", 1)):
        end = LENGTH_M / 2
        yield f"corner_{half}_{side}_outer", outer, sign * end
        yield f"corner_{half}_{side}_inner", inner, sign * (end - LINE_M)
        yield f"corner_{half}_{side}_middle", middle, sign * (end - LINE_M / 2)
        yield f"attack_{half}_{side}_outer_rear", outer, sign * ATTACK_M
        yield f"attack_{half}_{side}_inner_rear", inner, sign * ATTACK_M
        yield f"attack_{half}_{side}_inner_front", inner, sign * (ATTACK_M - LINE_M)
        yield f"attack_{half}_{side}_middle", middle, sign * (ATTACK_M - LINE_M / 2)
        yield f"centre_{side}_inner_{half}", inner, sign * LINE_M / 2
    yield f"centre_{side}_outer", outer, 0.0
    yield f"centre_{side}_middle", middle, 0.0


def _above(side: str, height: float) -> Iterator[tuple[str, tuple[float, float, float], tuple[float, float, float]]]:
    x, top = WIDTH_M / 2, height + NET_RISE_M
    band = (BAND_SD_M, PAINT_SD_M, RISE_SD_M)
    antenna = (BAND_SD_M, BAND_SD_M, BAND_SD_M)
    yield f"net_{side}_top", (x, 0.0, top), band
    yield f"net_{side}_bottom", (x, 0.0, top - NET_DEPTH_M), (BAND_SD_M, 2 * BAND_SD_M, BAND_SD_M)
    yield f"antenna_{side}_top", (x, 0.0, top + ANTENNA_M), antenna
    yield f"post_{side}_top", (x + POST_OUTSIDE_M, 0.0, POST_M), (POST_SD_M, 2 * BAND_SD_M, BAND_SD_M)


def _point(place: tuple[float, ...], sd: tuple[float, ...]) -> ScenePoint:
    return ScenePoint(np.array(place), np.array(sd))
