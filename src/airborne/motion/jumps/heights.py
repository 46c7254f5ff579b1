"""The jumps of several players: heights by every definition, times, places, speeds; each with a 95 % interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.motion.free_fall import GRAVITY_M_S2
from airborne.motion.jumps.events import Flight, find_flights, flight_of
from airborne.motion.jumps.jump import UNKNOWN, Jump, Measured
from airborne.motion.jumps.leg_track import LegTrack, leg_track
from airborne.motion.jumps.standing_posture import standing
from airborne.motion.local_polynomials import N_DRAWS, local_fits, peak_draws
from airborne.motion.players import PlayersMotion

Array = NDArray[np.floating]

BLOCK_LEVEL_M = 0.3
_SEED = 0
_PEAK_HALF_S = 0.1
_HIPS_BEND = (-GRAVITY_M_S2, 3.0, 30.0)  # at the peak: mean and deviation [m/s2], deviation of the change [m/s3]
_FEET_BEND = (-GRAVITY_M_S2, 6.0, 100.0)
_BEFORE_S = 0.3
_UNSEEN_LIMBS_M_S = 0.05  # what arms and trunk, a tenth and half of the mass, may add to the speed of the whole body
_NEAR_S = 5.0  # of the flight: where its player is looked for standing


def jumps(motion: PlayersMotion, *, block_level_m: float = BLOCK_LEVEL_M) -> tuple[Jump, ...]:
    """Measure every flight of every player, in the players' order and then in time; empty where nobody jumps.

    A flight needs both ankles 0.12 m over where they stand for 0.1 s and a body in free fall. Intervals hold the noise
    that the covariances state, a tenth of each variance white and the rest fading over 0.3 s (see
    `contact.OF_PLAYERS`), and are widened where a flight shows more. The same motion always gives the same numbers.
    Raises ResultError where hips, knees or ankles are not among the joints.
    """
    found: list[Jump] = []
    for player in motion.players:
        track = leg_track(motion, player)
        flights = find_flights(track)
        floor = np.ones(len(track.time_s), bool)
        for first, last in flights:
            floor[first : last + 1] = False
        for number, rows in enumerate(flights, 1):
            rng = np.random.default_rng((_SEED, number))
            middle = (track.time_s[rows[0]] + track.time_s[rows[1]]) / 2
            near = floor & (np.abs(track.time_s - middle) <= _NEAR_S)
            flight = flight_of(rng, track, rows, near)
            found.append(_jump(rng, track, flight, near, number=number, block_level_m=block_level_m))
    return tuple(found)


def _jump(
    rng: np.random.Generator,
    track: LegTrack,
    flight: Flight,
    floor: NDArray[np.bool_],
    *,
    number: int,
    block_level_m: float,
) -> Jump:
    track = track.scaled(flight.noise_scale)
    takeoff, landing = flight.takeoff_s, flight.landing_s
    stand, hips_stand, ankles_stand = standing(rng, track, floor)
    hips = _peak(rng, track, flight, track.mid_hips, _HIPS_BEND)
    ankles = _peak(rng, track, flight, track.mid_ankles, _FEET_BEND)
    unseen = _UNSEEN_LIMBS_M_S * rng.standard_normal(N_DRAWS)
    speed = None if takeoff is None else flight.speed(takeoff) + unseen
    flight_s = None if takeoff is None or landing is None else landing - takeoff
    start, end = _place(rng, track, takeoff), _place(rng, track, landing)
    rows = _rows(track, flight)
    over = None if hips is None else np.maximum(hips - hips_stand - block_level_m, 0.0)
    known = np.isfinite(track.hips[rows]).all(axis=(1, 2)) & np.isfinite(track.ankles[rows]).all(axis=(1, 2))
    return Jump(
        player=track.player,
        number=number,
        status=_STATUS[takeoff is not None, landing is not None],
        n_lost=int((~known).sum()),
        n_uncertain=int(track.is_uncertain[rows].sum()),
        takeoff_s=Measured.of(takeoff),
        landing_s=Measured.of(landing),
        takeoff_frame=Measured.of(_frames(track, takeoff)),
        landing_frame=Measured.of(_frames(track, landing)),
        flight_s=Measured.of(flight_s),
        foot_height_m=Measured.of(None if ankles is None else ankles - ankles_stand),
        hip_height_m=Measured.of(None if hips is None else hips - hips_stand),
        flight_time_height_m=Measured.of(None if flight_s is None else GRAVITY_M_S2 * flight_s**2 / 8),
        takeoff_speed_height_m=Measured.of(None if speed is None else speed**2 / (2 * GRAVITY_M_S2)),
        hip_rise_m=_rise(rng, track, takeoff, hips),
        takeoff_speed_m_s=Measured.of(speed),
        block_s=Measured.of(None if over is None else 2 * np.sqrt(2 * over / GRAVITY_M_S2)),
        block_level_m=block_level_m,
        drift_m=Measured.of(None if start is None or end is None else np.linalg.norm(end - start, axis=1)),
        takeoff_place_m=_both(start),
        landing_place_m=_both(end),
        hip_peak_speed_m_s=_peak_speed(track, flight, track.mid_hips[0][:, None], track.mid_hips[1][:, None]),
        foot_peak_speed_m_s=_peak_speed(track, flight, track.ankles, track.variances["ankles"]),
        reach_m=_reach(rng, track, flight),
        standing=stand,
        noise_scale=flight.noise_scale,
        path_frames=track.index[rows],
        path_s=track.time_s[rows],
        foot_paths_m=track.ankles[rows],
    )


_STATUS = {(True, True): "whole", (False, True): "no take-off", (True, False): "no landing", (False, False): "neither"}


def _rows(track: LegTrack, flight: Flight) -> NDArray[np.intp]:
    """Return the frames of a flight, from take-off to landing where they are known."""
    first, last = (float(track.time_s[row]) for row in flight.rows)
    start = first if flight.takeoff_s is None else float(np.median(flight.takeoff_s))
    end = last if flight.landing_s is None else float(np.median(flight.landing_s))
    return np.flatnonzero((track.time_s >= start) & (track.time_s <= end))


def _frames(track: LegTrack, at_s: Array | None) -> Array | None:
    return None if at_s is None else np.interp(at_s, track.time_s, track.index)


def _peak(
    rng: np.random.Generator,
    track: LegTrack,
    flight: Flight,
    path: tuple[Array, Array],
    bend: tuple[float, float, float],
) -> Array | None:
    """Draw the peak height of a path in flight (draws,) [m]; None where the frames around it are not known."""
    height, variance = path[0][:, 2], path[1][:, 2]
    at = _peak_time(track, flight, height)
    if at is None:
        return None
    near = np.isfinite(height) & (np.abs(track.time_s - at) <= _PEAK_HALF_S)
    near[: flight.rows[0]] = near[flight.rows[1] + 1 :] = False
    u = track.time_s[near] - at
    if near.sum() < 5 or u[0] > -_PEAK_HALF_S / 2 or u[-1] < _PEAK_HALF_S / 2:
        return None
    return peak_draws(rng, u, height[near], variance[near], bend=bend)


def _peak_time(track: LegTrack, flight: Flight, height: Array) -> float | None:
    """Return when the best parabola through the highest half of a flight's heights is at its top [s]."""
    rows = np.arange(flight.rows[0], flight.rows[1] + 1)
    rows = rows[np.isfinite(height[rows])]
    if len(rows) < 5:
        return None
    rows = rows[height[rows] >= np.median(height[rows])]
    u = track.time_s[rows] - track.time_s[rows].mean()
    a, b, _ = np.polyfit(u, height[rows], 2) if len(rows) > 2 else (0.0, 0.0, 0.0)
    return float(track.time_s[rows].mean() - b / (2 * a)) if a < 0 else None


def _place(rng: np.random.Generator, track: LegTrack, at_s: Array | None) -> Array | None:
    """Draw where the ankles' middle is on the floor at an event: (draws, 2) [m]."""
    return _drawn(rng, track, track.mid_ankles[0][:, :2], track.mid_ankles[1][:, :2], at_s)


def _rise(rng: np.random.Generator, track: LegTrack, takeoff_s: Array | None, peak: Array | None) -> Measured:
    start = _drawn(rng, track, track.mid_hips[0][:, 2:], track.mid_hips[1][:, 2:], takeoff_s)
    return UNKNOWN if start is None or peak is None else Measured.of(peak - start[:, 0])


def _drawn(
    rng: np.random.Generator, track: LegTrack, values: Array, variance: Array, at_s: Array | None
) -> Array | None:
    """Draw values (draws, k) at the drawn times of an event, its time and the tracking both uncertain."""
    if at_s is None:
        return None
    middle = float(np.median(at_s))
    (fit,), (covariance,) = local_fits(track.time_s, values, variance, np.array([middle]))
    if not np.isfinite(fit).all():
        return None
    sd = np.sqrt(covariance[:, 0, 0])
    return fit[0] + fit[1] * (at_s - middle)[:, None] + sd * rng.standard_normal((N_DRAWS, len(sd)))


def _both(draws: Array | None) -> tuple[Measured, Measured]:
    return (UNKNOWN, UNKNOWN) if draws is None else (Measured.of(draws[:, 0]), Measured.of(draws[:, 1]))


def _peak_speed(track: LegTrack, flight: Flight, points: Array, variance: Array) -> Measured:
    """Return the greatest speed of any of the points (n, k, 3) [m/s], slopes of parabolas over nine frames."""
    start = float(track.time_s[flight.rows[0]] if flight.takeoff_s is None else np.median(flight.takeoff_s)) - _BEFORE_S
    end = float(track.time_s[flight.rows[1]] if flight.landing_s is None else np.median(flight.landing_s))
    at_s = track.time_s[(track.time_s >= start) & (track.time_s <= end)]
    best = UNKNOWN
    for k in range(points.shape[1]):
        fit, covariance = local_fits(track.time_s, points[:, k], variance[:, k], at_s)
        speed = np.linalg.norm(fit[:, 1], axis=1)
        if not np.isfinite(speed).any():
            continue
        row = int(np.nanargmax(speed))
        fastest = float(speed[row])
        if not fastest <= best.value:
            along = fit[row, 1] / fastest if fastest else fit[row, 1]
            sd = float(np.sqrt(along**2 @ covariance[row, :, 1, 1]))
            best = Measured(fastest, max(fastest - 1.96 * sd, 0.0), fastest + 1.96 * sd)
    return best


def _reach(rng: np.random.Generator, track: LegTrack, flight: Flight) -> Measured:
    """Return the height of the higher wrist over the floor at its peak."""
    if track.wrists is None:
        return UNKNOWN
    each = [(track.wrists[:, k], track.variances["wrists"][:, k]) for k in range(2)]
    peaks = [peak for path in each if (peak := _peak(rng, track, flight, path, _FEET_BEND)) is not None]
    return Measured.of(np.max(peaks, axis=0)) if peaks else UNKNOWN
