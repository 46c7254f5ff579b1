"""The jumps of several players: heights by every definition, times, positions, speeds, with 95 % intervals."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from airborne.constants import GRAVITY_M_S2
from airborne.motion.jumps.events import FlightPosterior, find_flights, find_slow_falls, sample_flight
from airborne.motion.jumps.jump import UNKNOWN, Jump, Measurement, are_legs_lost
from airborne.motion.jumps.leg_track import LegTrack, extract_legs
from airborne.motion.jumps.standing_posture import NEAR_S, measure_standing_posture
from airborne.motion.local_polynomials import N_DRAWS, local_fits, peak_draws
from airborne.motion.players import PlayersMotion
from airborne.types import Array

_BLOCK_LEVEL_M = 0.3  # rise of the feet over which a blocker counts as up, unless given
_SEED = 0  # any number: results repeat
_PEAK_HALF_S = 0.1  # half width of the parabola at the peak
_HIPS_ACCELERATION_PRIOR = (-GRAVITY_M_S2, 3.0, 30.0)  # at the peak: mean and sd [m/s2], sd of the jerk [m/s3]
_FEET_ACCELERATION_PRIOR = (-GRAVITY_M_S2, 6.0, 100.0)  # the same of feet, which also turn about the knees
_BEFORE_S = 0.3  # of take-off: speeds are sought from there
_UNTRACKED_LIMBS_M_S = 0.05  # sd of the body's speed due to arms and trunk, a tenth and half of the mass
# [1/s] frames from which jumps are measured: the least at which blocks were tried. At 20 a second a foot of the
# recorded block jump is 1 m off, and at 15 a flight of a synthetic one 0.14 s too short
LEAST_RATE_HZ = 29.0


def measure_jumps(motion: PlayersMotion, *, block_level_m: float = _BLOCK_LEVEL_M) -> tuple[Jump, ...]:
    """Measure every flight, by player and then by time; empty if nobody jumps, and below LEAST_RATE_HZ.

    A flight needs both ankles 0.12 m over their standing height for 0.1 s and a body in free fall. Intervals cover the
    noise that the covariances state, a tenth of each variance white and the rest correlated over 0.3 s (see
    `free_fall.PLAYER_NOISE`), and are widened where a flight shows more. Results are deterministic. Raises
    ResultError where hips, knees or ankles are not among the joints.
    """
    jumps: list[Jump] = []
    if motion.rate < LEAST_RATE_HZ:
        return ()
    for player in motion.players:
        track = extract_legs(motion, player)
        flights = find_flights(track)
        floor = np.ones(len(track.time_s), bool)
        for first, last in flights:
            floor[first : last + 1] = False
        for number, rows in enumerate(flights, 1):
            middle = (track.time_s[rows[0]] + track.time_s[rows[1]]) / 2
            near = floor & (np.abs(track.time_s - middle) <= NEAR_S)
            flight = sample_flight(_generator(number, "flight"), track, rows, near)
            jumps.append(_measure_jump(track, flight, near, number=number, block_level_m=block_level_m))
    return tuple(jumps)


def describe_slow_falls(motion: PlayersMotion) -> list[str]:
    """Say where both feet of a player were up and the body fell too slowly for a jump: the frame rate may be wrong."""
    said = []
    for player in motion.players if motion.rate >= LEAST_RATE_HZ else ():
        track = extract_legs(motion, player)
        for first, last, fall_m_s2 in find_slow_falls(track):
            up_s = track.time_s[last] - track.time_s[first]
            said.append(
                f"{player}: from frame {track.index[first]} both feet are up for {up_s:.2f} s while the body falls "
                f"at {fall_m_s2:.1f} m/s², not at {GRAVITY_M_S2:.2f}: this is no jump, or the stated frame rate is "
                f"{np.sqrt(fall_m_s2 / GRAVITY_M_S2):.2f} times that at which it was filmed"
            )
    return said


def _generator(number: int, measurement: str) -> np.random.Generator:
    """Return a measurement's own random numbers in a player's jump of this number: a new one moves no other."""
    return np.random.default_rng((_SEED, number, *measurement.encode()))


def _measure_jump(
    track: LegTrack,
    flight: FlightPosterior,
    floor: NDArray[np.bool_],
    *,
    number: int,
    block_level_m: float,
) -> Jump:
    track = track.scale_variances(flight.noise_scale)
    takeoff, landing = flight.takeoff_s, flight.landing_s
    rng = partial(_generator, number)
    stand, hips_stand, ankles_stand = measure_standing_posture(rng("standing"), track, floor)
    hips = _peak(rng("hips"), track, flight, track.mid_hips, acceleration_prior=_HIPS_ACCELERATION_PRIOR)
    ankles = _peak(rng("ankles"), track, flight, track.mid_ankles, acceleration_prior=_FEET_ACCELERATION_PRIOR)
    foot_height = None if ankles is None else ankles - ankles_stand
    hip_height = None if hips is None else hips - hips_stand
    tuck = Measurement.from_draws(None if foot_height is None or hip_height is None else foot_height - hip_height)
    is_astray = are_legs_lost(flight.noise_scale, tuck.value)
    if is_astray:  # feet tell take-off and landing
        foot_height = takeoff = landing = None
    limb_speed = _UNTRACKED_LIMBS_M_S * rng("speed").standard_normal(N_DRAWS)
    speed = None if takeoff is None else flight.speed(takeoff) + limb_speed
    flight_s = None if takeoff is None or landing is None else landing - takeoff
    start = _ankle_position_draws(rng("takeoff_position"), track, takeoff)
    end = _ankle_position_draws(rng("landing_position"), track, landing)
    rows = _flight_rows(track, flight)
    n_uncertain, n_hips_uncertain = (int(each[rows].sum()) for each in (track.is_uncertain, track.are_hips_uncertain))
    over = None if hip_height is None else np.maximum(hip_height - block_level_m, 0.0)
    is_known = np.isfinite(track.hips[rows]).all(axis=(1, 2)) & np.isfinite(track.ankles[rows]).all(axis=(1, 2))
    return Jump(
        player=track.player,
        number=number,
        status=_STATUS[takeoff is not None, landing is not None],
        n_lost=int((~is_known).sum()),
        n_uncertain=n_uncertain,
        n_hips_uncertain=n_hips_uncertain,
        takeoff_s=Measurement.from_draws(takeoff),
        landing_s=Measurement.from_draws(landing),
        takeoff_frame=Measurement.from_draws(_frames(track, takeoff)),
        landing_frame=Measurement.from_draws(_frames(track, landing)),
        flight_s=Measurement.from_draws(flight_s),
        foot_height_m=Measurement.from_draws(foot_height),
        hip_height_m=Measurement.from_draws(hip_height),
        tuck_m=tuck,
        flight_time_height_m=Measurement.from_draws(None if flight_s is None else GRAVITY_M_S2 * flight_s**2 / 8),
        takeoff_speed_height_m=Measurement.from_draws(None if speed is None else speed**2 / (2 * GRAVITY_M_S2)),
        hip_rise_m=_hip_rise(rng("hip_rise"), track, takeoff, hips),
        takeoff_speed_m_s=Measurement.from_draws(speed),
        block_s=Measurement.from_draws(None if over is None else 2 * np.sqrt(2 * over / GRAVITY_M_S2)),
        block_level_m=block_level_m,
        drift_m=_length(None if start is None or end is None else end - start),
        takeoff_position_m=_xy(start),
        landing_position_m=_xy(end),
        hip_peak_speed_m_s=_peak_speed(track, flight, track.mid_hips[0][:, None], track.mid_hips[1][:, None]),
        foot_peak_speed_m_s=UNKNOWN
        if is_astray
        else _peak_speed(track, flight, track.ankles, track.variances["ankles"]),
        reach_m=_reach(rng("reach"), track, flight),
        standing=stand,
        noise_scale=flight.noise_scale,
        path_frames=track.index[rows],
        path_s=track.time_s[rows],
        foot_paths_m=track.ankles[rows],
    )


def _length(draws: Array | None) -> Measurement:
    """Measure the length of a vector by draws of it (n, k) along their mean, as theirs are longer than the mean's."""
    if draws is None:
        return Measurement.from_draws(None)
    mean = draws.mean(axis=0)
    found = Measurement.from_draws(draws @ (mean / max(float(np.linalg.norm(mean)), 1e-12)))
    return found._replace(low=max(found.low, 0.0))


_STATUS = {(True, True): "whole", (False, True): "no take-off", (True, False): "no landing", (False, False): "neither"}


def _flight_rows(track: LegTrack, flight: FlightPosterior) -> NDArray[np.intp]:
    """Return the frames of a flight, from take-off to landing where these are known."""
    first, last = (float(track.time_s[row]) for row in flight.rows)
    start = first if flight.takeoff_s is None else float(np.median(flight.takeoff_s))
    end = last if flight.landing_s is None else float(np.median(flight.landing_s))
    return np.flatnonzero((track.time_s >= start) & (track.time_s <= end))


def _frames(track: LegTrack, at_s: Array | None) -> Array | None:
    return None if at_s is None else np.interp(at_s, track.time_s, track.index)


def _peak(
    rng: np.random.Generator,
    track: LegTrack,
    flight: FlightPosterior,
    path: tuple[Array, Array],
    *,
    acceleration_prior: tuple[float, float, float],
) -> Array | None:
    """Draw the peak height of a path in flight (draws,) [m].

    None where the frames around it are unknown, or were seen by fewer than two cameras.
    """
    height, variance = path[0][:, 2], path[1][:, 2]
    at = _peak_time(track, flight, height)
    if at is None:
        return None
    near = np.isfinite(height) & track.is_measured & (np.abs(track.time_s - at) <= _PEAK_HALF_S)
    near[: flight.rows[0]] = near[flight.rows[1] + 1 :] = False
    u = track.time_s[near] - at
    if near.sum() < 5 or u[0] > -_PEAK_HALF_S / 2 or u[-1] < _PEAK_HALF_S / 2:
        return None
    return peak_draws(rng, u, height[near], variance[near], acceleration_prior=acceleration_prior)


def _peak_time(track: LegTrack, flight: FlightPosterior, height: Array) -> float | None:
    """Return the apex time of the best parabola through the highest half of a flight's heights [s]."""
    rows = np.arange(flight.rows[0], flight.rows[1] + 1)
    rows = rows[np.isfinite(height[rows])]
    if len(rows) < 5:
        return None
    rows = rows[height[rows] >= np.median(height[rows])]
    u = track.time_s[rows] - track.time_s[rows].mean()
    a, b, _ = np.polyfit(u, height[rows], 2) if len(rows) > 2 else (0.0, 0.0, 0.0)
    return float(track.time_s[rows].mean() - b / (2 * a)) if a < 0 else None


def _ankle_position_draws(rng: np.random.Generator, track: LegTrack, at_s: Array | None) -> Array | None:
    """Draw the horizontal position of the mid-ankles at an event: (draws, 2) [m]."""
    position, variance = track.mid_ankles
    return _draws_at_event(rng, track, at_s, values=position[:, :2], variance=variance[:, :2])


def _hip_rise(rng: np.random.Generator, track: LegTrack, takeoff_s: Array | None, peak: Array | None) -> Measurement:
    position, variance = track.mid_hips
    start = _draws_at_event(rng, track, takeoff_s, values=position[:, 2:], variance=variance[:, 2:])
    return UNKNOWN if start is None or peak is None else Measurement.from_draws(peak - start[:, 0])


def _draws_at_event(
    rng: np.random.Generator, track: LegTrack, at_s: Array | None, *, values: Array, variance: Array
) -> Array | None:
    """Draw values (draws, k) at the drawn times of an event: both its time and the tracking are uncertain."""
    if at_s is None:
        return None
    middle = float(np.median(at_s))
    (fit,), (covariance,) = local_fits(track.time_s, values, variance, np.array([middle]))
    if not np.isfinite(fit).all():
        return None
    sd = np.sqrt(covariance[:, 0, 0])
    return fit[0] + fit[1] * (at_s - middle)[:, None] + sd * rng.standard_normal((N_DRAWS, len(sd)))


def _xy(draws: Array | None) -> tuple[Measurement, Measurement]:
    return (
        (UNKNOWN, UNKNOWN)
        if draws is None
        else (Measurement.from_draws(draws[:, 0]), Measurement.from_draws(draws[:, 1]))
    )


def _peak_speed(track: LegTrack, flight: FlightPosterior, points: Array, variance: Array) -> Measurement:
    """Return the peak speed of any of the points (n, k, 3) [m/s]: slopes of parabolas over nine frames."""
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
            direction = fit[row, 1] / fastest if fastest else fit[row, 1]
            sd = float(np.sqrt(direction**2 @ covariance[row, :, 1, 1]))
            best = Measurement(fastest, max(fastest - 1.96 * sd, 0.0), fastest + 1.96 * sd)
    return best


def _reach(rng: np.random.Generator, track: LegTrack, flight: FlightPosterior) -> Measurement:
    """Return the peak height of the higher wrist over the floor."""
    if track.wrists is None:
        return UNKNOWN
    each = [(track.wrists[:, k], track.variances["wrists"][:, k]) for k in range(2)]
    peaks = [
        peak
        for path in each
        if (peak := _peak(rng, track, flight, path, acceleration_prior=_FEET_ACCELERATION_PRIOR)) is not None
    ]
    return Measurement.from_draws(np.max(peaks, axis=0)) if peaks else UNKNOWN
