"""Take-off and landing of a motion: the boundaries that no filter may cross."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.constants import GRAVITY_M_S2
from airborne.motion.flight.fall import (
    FEWEST_OF_SPAN,
    SPAN_S,
    SUPPORTED_M_S2,
    UNKNOWN_SD_M,
    is_free_fall,
    local_accelerations,
)
from airborne.motion.flight.momentum_table import centres_of_mass, has_inertias
from airborne.motion.free_fall import GENERIC_NOISE, combine_sides, noise_covariance, side_likelihood
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.motion import Motion
from airborne.motion.players import PlayersMotion
from airborne.motion.smoothing import crossings
from airborne.motion.uncertainty import standard_deviation
from airborne.types import Array

_SHORTEST_S = 0.1  # of a flight: about its peak a body falls 1 cm in it
_REGULARISATION = 0.05  # ridge of the point that falls most freely
_SEEK_S, _GRID_S = 0.12, 1 / 480  # search window of an event about the threshold, and its grid
_CONTACT_S = 0.15  # of contact that is used
_FEWEST = 4  # known frames of contact that an event needs


class Event(NamedTuple):
    """End or beginning of contact with the floor."""

    name: str  # "take-off" or "landing"
    time_s: float


def body_events(motion: Motion, model: BodyModel) -> tuple[Event, ...]:
    """Return the take-offs and landings of one body.

    Free fall is that of the centre of mass; for a body without masses, of the point fixed to its root that falls most
    freely (see `ballistic_point`). See `find_flight_events`.
    """
    if has_inertias(model):
        com, variance = centres_of_mass(motion, model)
        height, sd = com[:, 2], standard_deviation(variance[:, 2])
    else:
        height = (motion.position + motion.R @ ballistic_point(motion))[:, 2]
        sd = standard_deviation(motion.covariance[:, 2, 2])
    return find_flight_events(motion.time_s, height, sd**2)


def ballistic_point(motion: Motion) -> Array:
    """Return the point in the root's frame (3,) [m] that best follows a parabola of 9.81 m/s2: the centre of mass.

    x + R c = start + speed t + gravity t2 / 2 is linear in c; it is solved for every window of 0.4 s, with a weak
    Tikhonov regularisation of c, and the window with the smallest residual counts. The origin if no window is known.
    """
    best, point = np.inf, np.zeros(3)
    posed = np.flatnonzero(motion.has_pose)
    for first in posed:
        rows = posed[
            (motion.time_s[posed] >= motion.time_s[first]) & (motion.time_s[posed] <= motion.time_s[first] + SPAN_S)
        ]
        t = motion.time_s[rows] - motion.time_s[first]
        if len(rows) < FEWEST_OF_SPAN or t[-1] < 0.9 * SPAN_S:
            continue
        without_gravity = motion.position[rows] + 0.5 * GRAVITY_M_S2 * t[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
        line = np.kron(np.stack([np.ones_like(t), t], axis=1), np.eye(3))
        terms = np.vstack(
            [
                np.hstack([line, -motion.R[rows].reshape(-1, 3)]),
                np.hstack([np.zeros((3, 6)), _REGULARISATION * np.eye(3)]),
            ]
        )
        target = np.concatenate([without_gravity.ravel(), np.zeros(3)])
        solution = np.linalg.lstsq(terms, target, rcond=None)[0]
        residual = float(np.sqrt(np.mean((terms @ solution - target) ** 2)))
        if residual < best:
            best, point = residual, solution[6:]
    return np.asarray(point, float)


def player_events(motion: PlayersMotion) -> dict[str, tuple[Event, ...]]:
    """Return each player's take-offs and landings, as in `measure_jumps`; where an event is not reported, the end of
    the visible flight. Raises ResultError where hips, knees or ankles are not among the joints.
    """  # noqa: D205
    events: dict[str, tuple[Event, ...]] = {name: () for name in motion.players}
    for jump in measure_jumps(motion):
        start, end = jump.takeoff_s.value, jump.landing_s.value
        start = start if np.isfinite(start) else _inside(motion.time_s, float(jump.path_s[0]))
        end = end if np.isfinite(end) else _inside(motion.time_s, float(jump.path_s[-1]))
        pair = (Event("take-off", start), Event("landing", end))
        events[jump.player] += tuple(event for event in pair if np.isfinite(event.time_s))
    return events


def find_flight_events(time_s: Array, height_m: Array, variance: Array) -> tuple[Event, ...]:
    """Find the take-offs and landings of a path's heights (n,) [m] with variances (n,) [m2].

    Parabolas over 0.16 s give the acceleration. A flight is a span without one clearly (by two standard deviations)
    above -5 m/s2 that for 0.1 s or longer is within 2.5 m/s2 plus two standard deviations of -9.81. Its ends are the
    most likely times under `free_fall.side_likelihood`. An event whose contact has fewer than four known frames is not
    reported: the recording begins or ends in flight.
    """
    is_known = np.isfinite(height_m)
    time_s, height_m = time_s[is_known], height_m[is_known]
    is_stated = np.isfinite(variance[is_known]) & (variance[is_known] > 0)
    variance = np.where(is_stated, variance[is_known], UNKNOWN_SD_M**2)
    if len(time_s) < 2 * _FEWEST:
        return ()
    acceleration, sd = local_accelerations(time_s, height_m, variance)
    is_free = is_free_fall(acceleration, sd)
    events: list[Event] = []
    for start, stop in _spans_below(time_s, acceleration - 2 * sd - SUPPORTED_M_S2):
        if _longest_run_s(time_s, is_free & (time_s >= start) & (time_s <= stop)) >= _SHORTEST_S:
            events += _most_likely_events(time_s, height_m, variance, start_s=start, stop_s=stop)
    return tuple(events)


def _spans_below(time_s: Array, values: Array) -> list[tuple[float, float]]:
    """Return the spans of time in which a path (n,) is not known to be above zero."""
    path = np.concatenate([[1.0], np.where(np.isfinite(values), values, -1.0), [1.0]])
    t = np.concatenate([time_s[:1], time_s, time_s[-1:]])
    return list(zip(crossings(t, path, 0.0, rising=False).tolist(), crossings(t, path, 0.0).tolist(), strict=True))


def _longest_run_s(time_s: Array, mask: NDArray[np.bool_]) -> float:
    """Return the duration of the longest run of a mask (n,) [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]))).reshape(-1, 2)
    return max((float(time_s[last - 1] - time_s[first]) for first, last in edges), default=0.0)


def _most_likely_events(
    time_s: Array, height_m: Array, variance: Array, *, start_s: float, stop_s: float
) -> list[Event]:
    """Return the most likely take-off and landing of one flight found from `start_s` to `stop_s`."""
    origin = (start_s + stop_s) / 2
    grids, sides = [], []
    for is_takeoff, at in ((True, start_s), (False, stop_s)):
        grid = at + np.arange(-_SEEK_S, _SEEK_S, _GRID_S)
        contact = (time_s < grid[0]) if is_takeoff else (time_s > grid[-1])
        near = contact & (np.abs(time_s - at) <= _SEEK_S + _CONTACT_S)
        is_observed = bool(near.sum() >= _FEWEST)
        reach = (_SEEK_S + _CONTACT_S) if is_observed else 0.0
        grids.append(grid if is_observed else None)
        if not is_observed:
            grid = np.array([at - 1.0 if is_takeoff else at + 1.0])
        span = (time_s >= at - reach) & (time_s < origin) if is_takeoff else (time_s >= origin) & (time_s <= at + reach)
        noise = noise_covariance(time_s[span], variance[span], noise=GENERIC_NOISE)
        sides.append(
            side_likelihood(time_s[span] - origin, height_m[span], noise, grid - origin, is_takeoff=is_takeoff)
        )
    i, j = np.unravel_index(int(np.argmax(combine_sides(*sides)[0])), (len(sides[0].constant), len(sides[1].constant)))
    named = (("take-off", grids[0], i), ("landing", grids[1], j))
    return [Event(name, float(grid[k])) for name, grid, k in named if grid is not None]


def _inside(time_s: Sequence[float] | Array, at_s: float) -> float:
    """Return a time inside a recording; NaN at its very ends."""
    return at_s if time_s[0] < at_s < time_s[-1] else np.nan
