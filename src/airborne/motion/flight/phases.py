"""When a motion leaves the floor and comes back: the boundaries that no filter may cross."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.motion.flight.momentum_table import flight, has_inertias
from airborne.motion.free_fall import GRAVITY_M_S2, OF_ANYTHING, joined, noise_covariance, side
from airborne.motion.jumps.heights import jumps
from airborne.motion.motion import Motion
from airborne.motion.players import PlayersMotion
from airborne.motion.smoothing import crossings

Array = NDArray[np.floating]

_WINDOW_S = 0.16  # over which an acceleration is measured
_FREE_M_S2, _MOST_M_S2 = 2.5, 5.5  # from free fall: what any flight may show, and what noise may make of it at most
_SUPPORTED_M_S2 = -5.0  # who falls clearly slower is held up
_SHORTEST_S = 0.1
_SPAN_S, _FEWEST_OF_SPAN, _PULL = 0.4, 8, 0.05
_SEEK_S, _GRID_S = 0.12, 1 / 480
_CONTACT_S = 0.15
_UNKNOWN_SD_M = 0.02  # of a height whose covariance is not given
_FEWEST = 4  # known frames of contact without which an event is not claimed


class Event(NamedTuple):
    """The end of contact, or its beginning."""

    name: str  # "take-off" or "landing"
    time_s: float


def body_events(motion: Motion, model: BodyModel) -> tuple[Event, ...]:
    """Return the take-offs and landings that one body's motion shows.

    Of a body with masses the centre of mass must fall freely; of another the point of its root, wherever it is, that
    does so best (see `ballistic_point`). See `free_falls`.
    """
    if has_inertias(model):
        table = flight(motion, model)
        height, sd = (table[name].sel(space="z").to_numpy() for name in ("com", "com_sd"))
    else:
        height = (motion.position + motion.R @ ballistic_point(motion))[:, 2]
        sd = motion.position_sd[:, 2]
    return free_falls(motion.time_s, height, sd**2)


def ballistic_point(motion: Motion) -> Array:
    """Return the point of the root's axes (3,) [m] that keeps best to a parabola of 9.81 m/s2: where the mass is.

    x + R c = start + speed t + gravity t2 / 2 is linear in c; it is solved for every 0.4 s, with a weak pull of c to
    the origin, and the span counts whose path is nearest to its parabola. The origin where no span is known.
    """
    best, point = np.inf, np.zeros(3)
    known = np.flatnonzero(motion.has_pose)
    for first in known:
        rows = known[
            (motion.time_s[known] >= motion.time_s[first]) & (motion.time_s[known] <= motion.time_s[first] + _SPAN_S)
        ]
        t = motion.time_s[rows] - motion.time_s[first]
        if len(rows) < _FEWEST_OF_SPAN or t[-1] < 0.9 * _SPAN_S:
            continue
        fallen = motion.position[rows] + 0.5 * GRAVITY_M_S2 * t[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
        line = np.kron(np.stack([np.ones_like(t), t], axis=1), np.eye(3))
        terms = np.vstack(
            [np.hstack([line, -motion.R[rows].reshape(-1, 3)]), np.hstack([np.zeros((3, 6)), _PULL * np.eye(3)])]
        )
        aim = np.concatenate([fallen.ravel(), np.zeros(3)])
        solution = np.linalg.lstsq(terms, aim, rcond=None)[0]
        rest = float(np.sqrt(np.mean((terms @ solution - aim) ** 2)))
        if rest < best:
            best, point = rest, solution[6:]
    return point


def player_events(motion: PlayersMotion) -> dict[str, tuple[Event, ...]]:
    """Return each player's take-offs and landings, as `jumps` finds them; where an event is not claimed, the ends of
    the flight that is seen. Raises ResultError where hips, knees or ankles are not among the joints.
    """  # noqa: D205
    found: dict[str, tuple[Event, ...]] = {name: () for name in motion.players}
    for jump in jumps(motion):
        start, end = jump.takeoff_s.value, jump.landing_s.value
        start = start if np.isfinite(start) else _inside(motion.time_s, float(jump.path_s[0]))
        end = end if np.isfinite(end) else _inside(motion.time_s, float(jump.path_s[-1]))
        events = (Event("take-off", start), Event("landing", end))
        found[jump.player] += tuple(event for event in events if np.isfinite(event.time_s))
    return found


def free_falls(time_s: Array, height_m: Array, variance: Array) -> tuple[Event, ...]:
    """Find the take-offs and landings of a path's heights (n,) [m] with variances (n,) [m2].

    Parabolas over 0.16 s tell the acceleration. A flight is a span without any that is clearly (by two standard
    deviations) above -5 m/s2, if for 0.1 s or longer it is -9.81 within 2.5 m/s2 and two standard deviations. Its ends
    are the likeliest times under `contact.side`. An end whose contact has fewer than four known frames is not claimed:
    the recording begins or ends in flight.
    """
    is_known = np.isfinite(height_m)
    time_s, height_m = time_s[is_known], height_m[is_known]
    is_stated = np.isfinite(variance[is_known]) & (variance[is_known] > 0)
    variance = np.where(is_stated, variance[is_known], _UNKNOWN_SD_M**2)
    if len(time_s) < 2 * _FEWEST:
        return ()
    bend, sd = _accelerations(time_s, height_m, variance)
    is_free = np.abs(bend + GRAVITY_M_S2) <= np.minimum(_FREE_M_S2 + 2 * sd, _MOST_M_S2)
    events: list[Event] = []
    for start, stop in _spans_below(time_s, bend - 2 * sd - _SUPPORTED_M_S2):
        if _longest(time_s, is_free & (time_s >= start) & (time_s <= stop)) >= _SHORTEST_S:
            events += _ends(time_s, height_m, variance, start, stop)
    return tuple(events)


def _accelerations(time_s: Array, height_m: Array, variance: Array) -> tuple[Array, Array]:
    """Return the bend of the best parabola about each time [m/s2] and its deviation; NaN near ends and gaps."""
    bend, sd = np.full((2, len(time_s)), np.nan)
    period = float(np.median(np.diff(time_s)))
    for k, at in enumerate(time_s):
        rows = np.flatnonzero(np.abs(time_s - at) <= _WINDOW_S / 2 + 1e-9)
        u = time_s[rows] - at
        if len(rows) < 5 or u[0] > -_WINDOW_S / 2 + period or u[-1] < _WINDOW_S / 2 - period:
            continue
        hat = np.linalg.pinv(np.vander(u, 3))[0]
        bend[k] = 2 * hat @ height_m[rows]
        sd[k] = 2 * np.sqrt(hat @ noise_covariance(u, variance[rows], noise=OF_ANYTHING) @ hat)
    return bend, sd


def _spans_below(time_s: Array, values: Array) -> list[tuple[float, float]]:
    """Return the spans of time in which a path (n,) is not known to be above zero."""
    path = np.concatenate([[1.0], np.where(np.isfinite(values), values, -1.0), [1.0]])
    t = np.concatenate([time_s[:1], time_s, time_s[-1:]])
    return list(zip(crossings(t, path, 0.0, rising=False).tolist(), crossings(t, path, 0.0).tolist(), strict=True))


def _longest(time_s: Array, mask: NDArray[np.bool_]) -> float:
    """Return how long the longest run of a mask (n,) lasts [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]))).reshape(-1, 2)
    return max((float(time_s[last - 1] - time_s[first]) for first, last in edges), default=0.0)


def _ends(time_s: Array, height_m: Array, variance: Array, start_s: float, stop_s: float) -> list[Event]:
    """Return the likeliest take-off and landing of one flight that is seen from `start_s` to `stop_s`."""
    origin = (start_s + stop_s) / 2
    grids, sides = [], []
    for is_takeoff, at in ((True, start_s), (False, stop_s)):
        grid = at + np.arange(-_SEEK_S, _SEEK_S, _GRID_S)
        contact = (time_s < grid[0]) if is_takeoff else (time_s > grid[-1])
        near = contact & (np.abs(time_s - at) <= _SEEK_S + _CONTACT_S)
        is_seen = bool(near.sum() >= _FEWEST)
        reach = (_SEEK_S + _CONTACT_S) if is_seen else 0.0
        grids.append(grid if is_seen else None)
        if not is_seen:
            grid = np.array([at - 1.0 if is_takeoff else at + 1.0])
        span = (time_s >= at - reach) & (time_s < origin) if is_takeoff else (time_s >= origin) & (time_s <= at + reach)
        noise = noise_covariance(time_s[span], variance[span], noise=OF_ANYTHING)
        sides.append(side(time_s[span] - origin, height_m[span], noise, grid - origin, is_takeoff=is_takeoff))
    i, j = np.unravel_index(int(np.argmax(joined(*sides)[0])), (len(sides[0].constant), len(sides[1].constant)))
    named = (("take-off", grids[0], i), ("landing", grids[1], j))
    return [Event(name, float(grid[k])) for name, grid, k in named if grid is not None]


def _inside(time_s: Sequence[float] | Array, at_s: float) -> float:
    """Return a time that lies inside a recording, NaN for its very ends."""
    return at_s if time_s[0] < at_s < time_s[-1] else np.nan
