"""Heights of a player's hips and ankles while standing: from an upright stance, or from the leg lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.geometry.robust import robust_sd
from airborne.motion.free_fall import noise_covariance
from airborne.motion.jumps.events import standing_height
from airborne.motion.jumps.jump import Measurement, StandingPosture
from airborne.motion.jumps.leg_track import LegTrack
from airborne.motion.local_polynomials import N_DRAWS
from airborne.types import Array

WINDOW_S, NEAR_S = 0.25, 5.0  # chosen: of standing still; of the flight: where it is sought
_QUIET_M_S = 0.15  # of hips and ankles, at most
_STRAIGHT = 0.98  # hip-ankle distance in leg lengths: a knee flexed by no more than 20 degrees
_LEG_SHARE, _LEG_SHARE_SD = 0.985, 0.01  # standing height of hips over ankles, in leg lengths
_FLAT_SD_M = 0.005  # of the standing height of an ankle, beyond its noise


def measure_standing_posture(
    rng: np.random.Generator, track: LegTrack, floor: NDArray[np.bool_]
) -> tuple[StandingPosture, Array, Array]:
    """Measure the standing heights of hips and ankles, with draws of both (draws,) [m].

    `floor` (n,) marks the frames to use, outside all flights. The longest run of quiet upright frames counts; if none
    lasts 0.25 s, the hips are taken to stand 98.5 +- 1 % of thigh plus shank over the standing height of the ankles.
    """
    stance = _stance(track, floor)
    if len(stance):
        hips = _mean_draws(rng, track, track.mid_hips, stance)
        ankles = _mean_draws(rng, track, track.mid_ankles, stance)
        frames = int(track.index[stance[0]]), int(track.index[stance[-1]])
        return _posture("stance", frames, hips, ankles), hips, ankles
    height, variance = _heights(track.mid_ankles)
    flat = standing_height(track.time_s[floor], height[floor])
    window = np.flatnonzero(floor & np.isfinite(height))[: _window(track)]
    sd = np.hypot(_FLAT_SD_M, _mean_sd(track.time_s, variance, window))
    ankles = flat + sd * rng.standard_normal(N_DRAWS)
    length = leg_lengths(track).mean() + _length_sd(track) * rng.standard_normal(N_DRAWS)
    hips = ankles + length * (_LEG_SHARE + _LEG_SHARE_SD * rng.standard_normal(N_DRAWS))
    return _posture("lengths", None, hips, ankles), hips, ankles


def leg_lengths(track: LegTrack) -> Array:
    """Return thigh plus shank, left and right: (2,) [m], corrected for noise bias; NaN where never known.

    Independent noise of variance s²/2 per axis and end lengthens a segment l by s²/l on average and adds a variance s²
    to it. The correction uses the observed variance, not the joints' covariances: errors that both ends share, as in a
    chain of constant lengths, leave the length unchanged.
    """
    lengths = np.zeros(2)
    for a, b in ((track.hips, track.knees), (track.knees, track.ankles)):
        segment = np.linalg.norm(a - b, axis=-1)
        for k in range(2):
            finite = segment[np.isfinite(segment[:, k]), k]
            median = float(np.median(finite)) if len(finite) else np.nan
            sd = robust_sd(finite) if len(finite) else np.nan
            lengths[k] += max(median - sd**2 / median, 0.0) if median else 0.0
    return lengths


def _window(track: LegTrack) -> int:
    return max(2, round(WINDOW_S / track.period_s))


def _length_sd(track: LegTrack) -> float:
    """Return the sd of the mean length of both legs, thigh and shank each with the noise of its two ends."""
    ends = track.variances["hips"] + 2 * track.variances["knees"] + track.variances["ankles"]
    rows = np.flatnonzero(np.isfinite(track.hips + track.knees + track.ankles).all(axis=(1, 2)))
    return _mean_sd(track.time_s, ends.mean(axis=(1, 2)) / 2, rows)


def _stance(track: LegTrack, floor: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the rows of the longest quiet upright stance; none if shorter than 0.25 s."""
    n = _window(track)
    points = np.concatenate([track.hips, track.ankles], axis=1)  # (n, 4, 3)
    is_known = np.isfinite(points).all(axis=(1, 2)) & floor
    lengths = leg_lengths(track)
    variance = np.concatenate([track.variances["hips"], track.variances["ankles"]], axis=1).mean(axis=(1, 2))
    starts: list[int] = []
    for start in np.flatnonzero(is_known[: len(points) - n + 1]).tolist():
        rows = slice(start, start + n)
        if is_known[rows].all() and _is_quiet_straight(track.time_s[rows], points[rows], lengths, variance[rows]):
            starts.append(start)
    if not starts:
        return np.empty(0, np.intp)
    longest = max(np.split(np.array(starts), np.flatnonzero(np.diff(starts) > 1) + 1), key=len)
    return np.arange(longest[0], longest[-1] + n)


def _is_quiet_straight(time_s: Array, points: Array, lengths: Array, variance: Array) -> bool:
    """Test whether hips and ankles (n, 4, 3) are slow, given their noise, and the legs straight."""
    mean = points.mean(axis=0)
    lengths = np.where(lengths > 0, lengths, np.nan)  # zero where noise exceeds the length
    if not np.mean(np.linalg.norm(mean[:2] - mean[2:], axis=-1) / lengths) >= _STRAIGHT:
        return False
    u = time_s - time_s.mean()
    slope = u / (u @ u)
    squared = (np.tensordot(slope, points, 1) ** 2).sum(axis=-1)  # (4,)
    from_noise = 3 * float(slope @ noise_covariance(time_s, variance) @ slope)
    return bool(squared.mean() < _QUIET_M_S**2 + from_noise and squared.max() < (_QUIET_M_S + 2 * from_noise**0.5) ** 2)


def _heights(path: tuple[Array, Array]) -> tuple[Array, Array]:
    return path[0][:, 2], path[1][:, 2]


def _mean_draws(rng: np.random.Generator, track: LegTrack, path: tuple[Array, Array], rows: NDArray[np.intp]) -> Array:
    height, variance = _heights(path)
    return height[rows].mean() + _mean_sd(track.time_s, variance, rows) * rng.standard_normal(N_DRAWS)


def _mean_sd(time_s: Array, variance: Array, rows: NDArray[np.intp]) -> float:
    """Return the sd of the mean over rows, at most the last 60 of them: more would hardly change it."""
    rows = rows[-60:]
    return float(np.sqrt(noise_covariance(time_s[rows], variance[rows]).mean())) if len(rows) else np.nan


def _posture(source: str, frames: tuple[int, int] | None, hips: Array, ankles: Array) -> StandingPosture:
    return StandingPosture(
        hips_m=Measurement.from_draws(hips), ankles_m=Measurement.from_draws(ankles), source=source, frames=frames
    )
