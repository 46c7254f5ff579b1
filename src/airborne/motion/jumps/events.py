"""Detection of flights, with their take-off and landing to a fraction of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.constants import GRAVITY_M_S2
from airborne.geometry.sampling import chi2_quantile
from airborne.motion.free_fall import (
    SWAY_M,
    SideLikelihood,
    combine_sides,
    free_fall_height,
    noise_covariance,
    side_likelihood,
)
from airborne.motion.jumps.leg_track import LegTrack
from airborne.motion.local_polynomials import N_DRAWS, local_fits
from airborne.types import Array

# of both ankles over their standing height: a heel rises by some 0.10 m while the toes still touch
_SURELY_OFF_M = 0.12
# of a flight; a dip below the level that is bridged; the same where joints are lost
_SHORTEST_S, _DIP_S, _BRIDGE_S = 0.1, 0.06, 0.3
_EARLIER_S, _LATER_S = 0.14, 0.06  # search window of an event, about the time at which the ankles pass that height
_CONTACT_S = 0.15  # of contact that is used
_GRID_S = 1 / 480  # at which the posterior of an event is computed
_MOST_SD_S = 0.03  # events with a larger standard deviation are not reported
_NEAR_S = 0.06  # from an event, chosen: three frames of 60 images a second on either side
_SLOWEST_FALL_M_S2 = -5.0  # about half of gravity: a body that falls more slowly is supported
_LEAST_FALL_M_S2 = -1.0  # chosen: a jump filmed at three times the stated rate falls at 9.81 / 9
_CLEAR_SDS = 2.0  # chosen: of an acceleration, by which it may be steeper, or must be steep
_ANKLE_RISE_M = {True: (0.09, 0.02), False: (0.06, 0.025)}  # at take-off, at landing: mean, standard deviation
_FOREFOOT_RISE_M = {True: (0.02, 0.01), False: (0.012, 0.01)}  # the toes are the last to leave
_STANDING_WINDOW_S, _STANDING_QUANTILE = 0.25, 0.2  # means over such windows; quantile of them that is standing


@dataclass(frozen=True, slots=True, eq=False)
class FlightPosterior:
    """One flight: posterior draws of its take-off, landing and parabola."""

    rows: tuple[int, int]  # first and last frame with both ankles clearly off the floor
    takeoff_s: Array | None  # (draws,); None where not observed
    landing_s: Array | None
    origin_s: float  # of the parabola
    parabola: Array  # (draws, 2) height [m] and upward speed [m/s] of the centre of mass at the origin
    noise_scale: float  # of the variances; above 1 where the flight shows more noise than stated

    def speed(self, at_s: Array) -> Array:
        """Upward speed of the centre of mass (draws,) [m/s]."""
        return self.parabola[:, 1] - GRAVITY_M_S2 * (at_s - self.origin_s)


class JumpFall(NamedTuple):
    """The centre of mass in a run of rows as a parabola of any acceleration; NaN where fewer than five are known."""

    acceleration_m_s2: float  # upward
    sd_m_s2: float  # by the stated errors
    noise: float  # mean square of the residuals over what is stated


def standing_height(time_s: Array, height_m: Array) -> float:
    """Return the height of a foot joint while the foot stands flat [m]; NaN where never known.

    The 20 % quantile of the means over 0.25 s: low enough to exclude raised heels, yet no extreme of the noise.
    """
    means = _moving_means(time_s, height_m)
    return float(np.nanquantile(means, _STANDING_QUANTILE)) if np.isfinite(means).any() else np.nan


def find_flights(track: LegTrack) -> tuple[tuple[int, int], ...]:
    """Return the first and last row of each flight: both ankles high, and the body in free fall."""
    return tuple(run for run in _airborne_runs(track) if _may_fall_freely(measure_fall(track, run)))


def find_slow_falls(track: LegTrack) -> tuple[tuple[int, int, float], ...]:
    """Return where both ankles are high and the body falls, yet slower than freely: first and last row, fall [m/s2].

    So falls a jump that was filmed at more images a second than its video says.
    """
    slow = []
    for first, last in _airborne_runs(track):
        fall = measure_fall(track, (first, last))
        fastest_up = fall.acceleration_m_s2 + _CLEAR_SDS * fall.sd_m_s2
        if not _may_fall_freely(fall) and fastest_up < _LEAST_FALL_M_S2:
            slow.append((first, last, -fall.acceleration_m_s2))
    return tuple(slow)


def measure_fall(track: LegTrack, rows: tuple[int, int]) -> JumpFall:
    """Fit a parabola to the centre of mass from a first to a last row."""
    time_s, height, variance = _centre_of_mass_heights(track, rows[0], rows[1] + 1)
    if len(time_s) < 5:
        return JumpFall(np.nan, np.nan, np.nan)
    weight = np.linalg.inv(noise_covariance(time_s, variance, sway_m=SWAY_M))
    terms = np.vander(time_s - time_s.mean(), 3)
    covariance = np.linalg.inv(terms.T @ weight @ terms)
    solution = covariance @ terms.T @ weight @ height
    residual = height - terms @ solution
    noise = float(residual @ weight @ residual) / (len(time_s) - 3)
    return JumpFall(float(2 * solution[0]), 2 * float(np.sqrt(covariance[0, 0])), noise)


def _airborne_runs(track: LegTrack) -> list[tuple[int, int]]:
    """Return the first and last row of each time in which both ankles are clearly over their standing height."""
    if len(track.time_s) < 2:
        return []
    height = np.min(track.ankles[:, :, 2] - _standing_ankle_heights(track, np.ones(len(track.time_s), bool)), axis=1)
    runs = _runs(track, height)
    on_floor = np.ones(len(height), bool)
    for first, last in runs:
        on_floor[first : last + 1] = False
    height = np.min(track.ankles[:, :, 2] - _standing_ankle_heights(track, on_floor), axis=1)
    return _runs(track, height)


def sample_flight(
    rng: np.random.Generator, track: LegTrack, rows: tuple[int, int], floor: NDArray[np.bool_]
) -> FlightPosterior:
    """Sample the take-off and landing of one flight; `floor` (n,) marks the frames outside all flights."""
    first, last = rows
    scale = _noise_scale(track, rows)
    track = track.scale_variances(scale)
    origin = float(track.time_s[first] + track.time_s[last]) / 2
    flat = {"ankles": _standing_ankle_heights(track, floor)}
    if track.forefeet is not None:
        flat["forefeet"] = np.array(
            [standing_height(track.time_s[floor], track.forefeet[floor, k, 2]) for k in range(2)]
        )
    grids, sides, extras = [], [], []
    for is_takeoff in (True, False):
        grid = _event_grid(track, rows, is_takeoff, floor)
        grids.append(grid)
        sides.append(_one_side(track, rows, grid, origin=origin, is_takeoff=is_takeoff))
        extras.append(np.zeros(1) if grid is None else _foot_log_likelihood(track, flat, grid, is_takeoff))
    log_p, mean, covariance = combine_sides(*sides)
    log_p = log_p + extras[0][:, None] + extras[1]
    picks = rng.choice(log_p.size, N_DRAWS, p=_normalise(log_p.ravel()))
    i, j = np.unravel_index(picks, log_p.shape)
    L = np.linalg.cholesky(covariance[i, j])
    parabola = mean[i, j] + (L @ rng.standard_normal((N_DRAWS, 2, 1)))[..., 0]
    events = [
        _reject_unseen(track, None if grid is None else grid[k] + rng.uniform(-0.5, 0.5, N_DRAWS) * _GRID_S)
        for grid, k in zip(grids, (i, j), strict=True)
    ]
    return FlightPosterior(rows, events[0], events[1], origin, parabola, scale)


def _standing_ankle_heights(track: LegTrack, floor: NDArray[np.bool_]) -> Array:
    """Return the ankles' height while standing, left and right: (2,) [m]."""
    if not floor.any():
        return np.full(2, np.nan)
    return np.array([standing_height(track.time_s[floor], track.ankles[floor, k, 2]) for k in range(2)])


def _moving_means(time_s: Array, values: Array) -> Array:
    """Return moving means over 0.25 s of values (n,), ignoring NaN; NaN where less than half is known."""
    if len(time_s) < 2:
        return values
    n = max(1, round(_STANDING_WINDOW_S / float(np.median(np.diff(time_s)))))
    n = min(n, len(values))
    windows = np.lib.stride_tricks.sliding_window_view(values, n)
    means = np.full(len(windows), np.nan)
    is_known = np.isfinite(windows).sum(axis=1) * 2 >= n
    means[is_known] = np.nanmean(windows[is_known], axis=1)
    return means


def _runs(track: LegTrack, height: Array) -> list[tuple[int, int]]:
    """Return the runs of rows with heights over the threshold, across short dips and gaps."""
    smooth = np.full(len(height), np.nan)
    padded = np.pad(height, 2, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 5)
    is_known = np.isfinite(windows).any(axis=1) & np.isfinite(height)
    smooth[is_known] = np.nanmedian(windows[is_known], axis=1)
    high = np.flatnonzero(smooth > _SURELY_OFF_M)
    runs: list[tuple[int, int]] = []
    for row in high.tolist():
        if runs and _belongs_to_run(track, smooth, runs[-1][1], row):
            runs[-1] = runs[-1][0], row
        else:
            runs.append((row, row))
    return [(a, b) for a, b in runs if track.time_s[b] - track.time_s[a] >= _SHORTEST_S]


def _belongs_to_run(track: LegTrack, smooth: Array, last: int, row: int) -> bool:
    gap_s = track.time_s[row] - track.time_s[last]
    is_gap = not np.isfinite(smooth[last + 1 : row]).any()
    return bool(gap_s <= (_BRIDGE_S if is_gap else _DIP_S))


def _may_fall_freely(fall: JumpFall) -> bool:
    return fall.acceleration_m_s2 - _CLEAR_SDS * fall.sd_m_s2 < _SLOWEST_FALL_M_S2


def _centre_of_mass_heights(track: LegTrack, start: int, stop: int) -> tuple[Array, Array, Array]:
    """Return times, heights of the centre of mass and variances of the known frames of rows start to stop."""
    height, variance = track.centre_of_mass_height
    rows = np.arange(start, stop)
    rows = rows[np.isfinite(height[rows])]
    return track.time_s[rows], height[rows], variance[rows]


def _noise_scale(track: LegTrack, rows: tuple[int, int]) -> float:
    """Return the factor by which squared residuals exceed the stated variances; 1 where not significant."""
    time_s, height, variance = _centre_of_mass_heights(track, rows[0], rows[1] + 1)
    u = time_s - time_s.mean()
    L = np.linalg.cholesky(noise_covariance(time_s, variance, sway_m=SWAY_M))
    line = np.linalg.solve(L, np.vander(u, 2))
    residual = np.linalg.solve(L, height - free_fall_height(u))
    residual = residual - line @ np.linalg.lstsq(line, residual, rcond=None)[0]
    chi_squared, freedom = float(residual @ residual), len(u) - 2
    return chi_squared / freedom if chi_squared > chi2_quantile(0.99, freedom) else 1.0


def _event_grid(track: LegTrack, rows: tuple[int, int], is_takeoff: bool, floor: NDArray[np.bool_]) -> Array | None:
    """Return the candidate times of an event [s], or None where its contact is not observed."""
    at = float(track.time_s[rows[0] if is_takeoff else rows[1]])
    early, late = (_EARLIER_S, _LATER_S) if is_takeoff else (_LATER_S, _EARLIER_S)
    into_contact = (at - track.time_s) if is_takeoff else (track.time_s - at)
    is_known = np.isfinite(track.centre_of_mass_height[0])
    contact = is_known & floor & (into_contact > 0) & (into_contact <= _EARLIER_S + _CONTACT_S)
    near = contact & (into_contact <= _EARLIER_S)
    if near.sum() < 2 or contact.sum() < 4:
        return None
    return at - early + _GRID_S * np.arange(float(round((early + late) / _GRID_S)))


def _one_side(
    track: LegTrack, rows: tuple[int, int], grid: Array | None, *, origin: float, is_takeoff: bool
) -> SideLikelihood:
    """Return the parabola's likelihood from one half of the flight and the contact next to it."""
    first, last = rows
    from_s, to_s = float(track.time_s[first]), float(track.time_s[last])
    if is_takeoff:
        from_s = from_s if grid is None else float(grid[0]) - _CONTACT_S
        is_in = (track.time_s >= from_s) & (track.time_s < origin)
    else:
        to_s = to_s if grid is None else float(grid[-1]) + _CONTACT_S
        is_in = (track.time_s <= to_s) & (track.time_s >= origin)
    inside = np.flatnonzero(is_in)
    start, stop = (int(inside[0]), int(inside[-1]) + 1) if len(inside) else (0, 0)
    time_s, height, variance = _centre_of_mass_heights(track, start, stop)
    if grid is None:
        grid = np.array([from_s - 1 if is_takeoff else to_s + 1])
    covariance = noise_covariance(time_s, variance, sway_m=SWAY_M)
    return side_likelihood(time_s - origin, height, covariance, grid - origin, is_takeoff=is_takeoff)


def _foot_log_likelihood(track: LegTrack, flat: dict[str, Array], grid: Array, is_takeoff: bool) -> Array:
    """Return the log-likelihood of candidate times given the rise of the lower ankle and forefoot: (times,)."""
    log_likelihood = np.zeros(len(grid))
    for name, points in (("ankles", track.ankles), ("forefeet", track.forefeet)):
        if points is None:
            continue
        mean, sd = (_ANKLE_RISE_M if name == "ankles" else _FOREFOOT_RISE_M)[is_takeoff]
        coarse = grid[:: max(1, round(track.period_s / 2 / _GRID_S))]
        rise, variance = _lower_foot_rise(track, points, name=name, flat=flat[name], times=coarse)
        if np.isfinite(rise).all():
            expected, total = np.interp(grid, coarse, rise), sd**2 + np.interp(grid, coarse, variance)
            log_likelihood -= 0.5 * (expected - mean) ** 2 / total + 0.5 * np.log(total)
    return log_likelihood


def _lower_foot_rise(track: LegTrack, points: Array, *, name: str, flat: Array, times: Array) -> tuple[Array, Array]:
    """Return the rise of the lower foot over its standing height, with its variance; the mean where none is lower.

    The minimum of two noisy heights is biased low, so they are averaged unless they clearly differ.
    """
    fit, covariance = local_fits(track.time_s, points[:, :, 2], track.variances[name][:, :, 2], times)
    rises, variance = fit[:, 0] - flat, covariance[..., 0, 0]
    lower = rises.argmin(axis=1)[:, None]
    differs = np.abs(rises[:, 0] - rises[:, 1]) > 2 * np.sqrt(variance.sum(axis=1))
    rise = np.where(differs, np.take_along_axis(rises, lower, axis=1)[:, 0], rises.mean(axis=1))
    return rise, np.where(differs, np.take_along_axis(variance, lower, axis=1)[:, 0], variance.sum(axis=1) / 4)


def _normalise(log_p: Array) -> Array:
    p = np.exp(log_p - log_p.max())
    return p / p.sum()


def _reject_unseen(track: LegTrack, draws: Array | None) -> Array | None:
    """Return draws of an event's time; None where they are far apart, or no frame near has a tracked ankle."""
    if draws is None or float(np.std(draws)) > _MOST_SD_S:
        return None
    is_near = np.abs(track.time_s - draws.mean()) <= _NEAR_S
    return draws if track.is_ankle_tracked[is_near].any() else None
