"""Choice of the cut-off: the residuals of a low-pass filter over many cut-offs, and the noise they reveal.

Winter's residual analysis: residuals of noise alone fall linearly with the cut-off; the line's intercept at 0 Hz is
the noise's RMS, and the cut-off whose residual equals it passes as much noise as it removes signal. Source: Winter,
"Biomechanics and Motor Control of Human Movement", section on the choice of cut-off frequency; Wells and Winter 1980.
Besides it, the cut-off whose residuals are closest to white noise: Challis 1999, "A procedure for the automatic
determination of filter cutoff frequency for the processing of biomechanical data".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airborne.motion.smoothing.butterworth import low_pass
from airborne.motion.smoothing.segments import finite_rows, stretches
from airborne.types import Array

LINE = (0.3, 0.6)  # of half the rate: where residuals are taken as pure noise
_LARGEST = 0.9  # of half the rate
_N_CUTOFFS = 60  # points of the curve
_LONGEST_LAG = 10  # frames
_SHORTEST = 12  # frames of a usable stretch


@dataclass(frozen=True, slots=True, eq=False)
class ResidualAnalysis:
    """Residuals over cut-offs, and the cut-offs chosen from them; NaN where undetermined."""

    cutoff_hz: Array  # (m,) tried
    residual: Array  # (m,) RMS, in the paths' unit
    whiteness: Array  # (m,) sum of squared autocorrelations of the residuals at lags 1 to 10, mean over the paths
    line: tuple[float, float]  # residual of noise alone: at 0 Hz, and its slope per Hz
    chosen_hz: float  # by the residuals (Winter)
    whitest_hz: float  # by their autocorrelation (Challis)
    n_values: int  # that were analysed

    @property
    def noise(self) -> float:
        """Standard deviation of the white noise on one axis, in the paths' unit."""
        return self.line[0]


def residual_analysis(
    time_s: Array, paths: Array, *, boundaries_s: Sequence[Sequence[float]] = ((),)
) -> ResidualAnalysis:
    """Analyse evenly sampled paths (n, paths, axes) together, each in stretches as in `smooth_stretches`.

    `boundaries_s` are those of each path, or one for all. Only stretches of twelve known frames or more count.
    """
    rate_hz = 1 / float(np.median(np.diff(time_s))) if len(time_s) > 1 else np.nan
    cutoff_hz = np.linspace(_LARGEST * rate_hz / 2 / _N_CUTOFFS, _LARGEST * rate_hz / 2, _N_CUTOFFS)
    squared, white, n, n_stretches = np.zeros(_N_CUTOFFS), np.zeros(_N_CUTOFFS), 0, 0
    for k in range(paths.shape[1]):
        own = boundaries_s[k] if len(boundaries_s) > 1 else boundaries_s[0]
        segment = np.searchsorted(np.sort(np.asarray(own, float)), time_s, side="right")
        for rows in stretches(time_s, finite_rows(paths[:, k]), segment, 0.0):
            values = paths[rows, k]
            if len(values) < _SHORTEST:
                continue
            residuals = np.stack([values - low_pass(values, cutoff_hz=float(f), rate_hz=rate_hz) for f in cutoff_hz])
            squared += (residuals**2).sum(axis=(1, 2))
            white += _autocorrelation(residuals).sum(axis=-1)
            n, n_stretches = n + values.size, n_stretches + values.shape[1]
    if not n:
        unknown = np.full(_N_CUTOFFS, np.nan)
        return ResidualAnalysis(cutoff_hz, unknown, unknown, (np.nan, np.nan), np.nan, np.nan, 0)
    residual = np.sqrt(squared / n)
    line = _noise_line(cutoff_hz, residual, rate_hz)
    whiteness = white / n_stretches
    return ResidualAnalysis(
        cutoff_hz=cutoff_hz,
        residual=residual,
        whiteness=whiteness,
        line=line,
        chosen_hz=_crossing_hz(cutoff_hz, residual, line[0]),
        whitest_hz=float(cutoff_hz[int(np.argmin(whiteness))]),
        n_values=n,
    )


def _noise_line(cutoff_hz: Array, residual: Array, rate_hz: float) -> tuple[float, float]:
    low, high = (share * rate_hz / 2 for share in LINE)
    is_noise = (cutoff_hz >= low) & (cutoff_hz <= high)
    slope, start = np.polyfit(cutoff_hz[is_noise], residual[is_noise], 1)
    return float(start), float(slope)


def _crossing_hz(cutoff_hz: Array, residual: Array, level: float) -> float:
    """Return the largest cut-off below which the residual is above a level; NaN where it never is."""
    above = np.flatnonzero(residual > level)
    if not len(above) or above[-1] + 1 == len(residual):
        return np.nan
    k = int(above[-1])
    share = (residual[k] - level) / (residual[k] - residual[k + 1])
    return float(cutoff_hz[k] + share * (cutoff_hz[k + 1] - cutoff_hz[k]))


def _autocorrelation(residuals: Array) -> Array:
    """Return the sums of squared autocorrelations (m, axes) of residuals (m, n, axes); 0 for residuals of zero."""
    power = (residuals**2).sum(axis=1)
    lags = range(1, min(_LONGEST_LAG, residuals.shape[1] // 2) + 1)
    products = np.stack([(residuals[:, lag:] * residuals[:, :-lag]).sum(axis=1) for lag in lags])
    return ((products / np.where(power > 0, power, np.inf)) ** 2).sum(axis=0)
