"""Where a player's hips and ankles are while standing: seen in a straight stance, or made of the legs' lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.geometry.robust import robust_sd
from airborne.motion.free_fall import noise_covariance
from airborne.motion.jumps.events import standing_height
from airborne.motion.jumps.jump import Measured, Standing
from airborne.motion.jumps.leg_track import LegTrack
from airborne.motion.local_polynomials import N_DRAWS

Array = NDArray[np.floating]

_WINDOW_S = 0.25
_QUIET_M_S = 0.15  # how fast hips and ankles may be
_STRAIGHT = 0.98  # distance of hip and ankle, in lengths of the leg: a knee bent by no more than 20 degrees
_LEG_SHARE, _LEG_SHARE_SD = 0.985, 0.01  # height of the hips over the ankles of one who stands, in lengths of the leg
_FLAT_SD_M = 0.005  # of the lowest place of an ankle, beyond its noise


def standing(rng: np.random.Generator, track: LegTrack, floor: NDArray[np.bool_]) -> tuple[Standing, Array, Array]:
    """Say where the hips and ankles stand, with draws of both heights (draws,) [m].

    `floor` (n,) marks the frames to look at, outside all flights. The longest run of quiet straight frames counts;
    where there is none of 0.25 s, the hips stand at 98.5 +- 1 % of thigh and shank over the ankles' place on the floor.
    """
    stance = _stance(track, floor)
    if len(stance):
        hips = _mean_draws(rng, track, *_heights(track.mid_hips), stance)
        ankles = _mean_draws(rng, track, *_heights(track.mid_ankles), stance)
        frames = int(track.index[stance[0]]), int(track.index[stance[-1]])
        return _named("stance", frames, hips, ankles), hips, ankles
    height, variance = _heights(track.mid_ankles)
    flat = standing_height(track.time_s[floor], height[floor])
    window = np.flatnonzero(floor & np.isfinite(height))[: _window(track)]
    sd = np.hypot(_FLAT_SD_M, _mean_sd(track.time_s, variance, window))
    ankles = flat + sd * rng.standard_normal(N_DRAWS)
    length = leg_lengths(track).mean() + _length_sd(track) * rng.standard_normal(N_DRAWS)
    hips = ankles + length * (_LEG_SHARE + _LEG_SHARE_SD * rng.standard_normal(N_DRAWS))
    return _named("lengths", None, hips, ankles), hips, ankles


def leg_lengths(track: LegTrack) -> Array:
    """Return thigh plus shank, left and right: (2,) [m], the noise of their ends taken out; NaN where never known.

    Noise of variance s² an axis that a thigh's ends do not share makes a length l longer by s²/l on the mean, and
    shows in it as that much variance. What it varies by is taken out, and not what the joints' covariances say: errors
    that both ends share, as in a chain of constant lengths, leave it as it is.
    """
    lengths = np.zeros(2)
    for a, b in ((track.hips, track.knees), (track.knees, track.ankles)):
        found = np.linalg.norm(a - b, axis=-1)
        for k in range(2):
            known = found[np.isfinite(found[:, k]), k]
            middle = float(np.median(known)) if len(known) else np.nan
            deviation = robust_sd(known) if len(known) else np.nan
            lengths[k] += max(middle - deviation**2 / middle, 0.0) if middle else 0.0
    return lengths


def _window(track: LegTrack) -> int:
    return max(2, round(_WINDOW_S / track.period_s))


def _length_sd(track: LegTrack) -> float:
    """Return the deviation of the mean length of both legs, thigh and shank each with the noise of its two ends."""
    ends = track.variances["hips"] + 2 * track.variances["knees"] + track.variances["ankles"]
    known = np.flatnonzero(np.isfinite(track.hips + track.knees + track.ankles).all(axis=(1, 2)))
    return _mean_sd(track.time_s, ends.mean(axis=(1, 2)) / 2, known)


def _stance(track: LegTrack, floor: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the rows of the longest quiet straight stance; none where it is shorter than 0.25 s."""
    n = _window(track)
    points = np.concatenate([track.hips, track.ankles], axis=1)  # (n, 4, 3)
    is_known = np.isfinite(points).all(axis=(1, 2)) & floor
    lengths = leg_lengths(track)
    variance = np.concatenate([track.variances["hips"], track.variances["ankles"]], axis=1).mean(axis=(1, 2))
    good: list[int] = []
    for start in np.flatnonzero(is_known[: len(points) - n + 1]).tolist():
        rows = slice(start, start + n)
        if is_known[rows].all() and _is_quiet_straight(track.time_s[rows], points[rows], lengths, variance[rows]):
            good.append(start)
    if not good:
        return np.empty(0, np.intp)
    longest = max(np.split(np.array(good), np.flatnonzero(np.diff(good) > 1) + 1), key=len)
    return np.arange(longest[0], longest[-1] + n)


def _is_quiet_straight(time_s: Array, points: Array, lengths: Array, variance: Array) -> bool:
    """Say whether hips and ankles (n, 4, 3) are slow, beyond what their noise makes of it, and the legs straight."""
    place = points.mean(axis=0)
    known = np.where(lengths > 0, lengths, np.nan)  # a length that noise hides is none
    if not np.mean(np.linalg.norm(place[:2] - place[2:], axis=-1) / known) >= _STRAIGHT:
        return False
    u = time_s - time_s.mean()
    slope = u / (u @ u)
    squared = (np.tensordot(slope, points, 1) ** 2).sum(axis=-1)  # (4,)
    from_noise = 3 * float(slope @ noise_covariance(time_s, variance) @ slope)
    return bool(squared.mean() < _QUIET_M_S**2 + from_noise and squared.max() < (_QUIET_M_S + 2 * from_noise**0.5) ** 2)


def _heights(path: tuple[Array, Array]) -> tuple[Array, Array]:
    return path[0][:, 2], path[1][:, 2]


def _mean_draws(
    rng: np.random.Generator, track: LegTrack, height: Array, variance: Array, rows: NDArray[np.intp]
) -> Array:
    return height[rows].mean() + _mean_sd(track.time_s, variance, rows) * rng.standard_normal(N_DRAWS)


def _mean_sd(time_s: Array, variance: Array, rows: NDArray[np.intp]) -> float:
    """Return the deviation of the mean over rows, at most the last 60 of them, as more cannot tell another story."""
    rows = rows[-60:]
    return float(np.sqrt(noise_covariance(time_s[rows], variance[rows]).mean())) if len(rows) else np.nan


def _named(source: str, frames: tuple[int, int] | None, hips: Array, ankles: Array) -> Standing:
    return Standing(hips_m=Measured.of(hips), ankles_m=Measured.of(ankles), source=source, frames=frames)
