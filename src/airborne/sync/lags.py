"""The lag of each camera, found by tracking again and again with the lags so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from airborne.errors import TrialError
from airborne.sync.offsets import Offsets
from airborne.tracking.camera_lags import LagEquations, solve_lags
from airborne.types import Array

LEAST_MOMENTS = 8  # chosen: at which somebody must be tracked, so that lags can be found
_GAIN = 1.6  # a first step is too short by about this factor, as those of the poses are
_MOST_GAIN = 6.0  # on a step, however nearly parallel the steps before
_MOST_PASSES = 8  # over the recording
_CONVERGED_S = 2e-5  # a step below it, or below ...
_CONVERGED_SDS = 0.1  # ... this share of the lag's sd, ends the iteration


@dataclass(frozen=True, slots=True, eq=False)
class CameraLags:
    """How much later than its time stamps each camera is; the first that sees the body keeps its lag. NaN: unknown."""

    lag_s: Array  # (c,)
    sd_s: Array  # (c,)
    drift: Array  # (c,) [s/s]; the lag holds at time 0
    drift_sd: Array  # (c,)

    def to_offsets(
        self, names: Sequence[str], first_s: float, *, who: str, how: str, notes: Sequence[str] = ()
    ) -> Offsets:
        """Return them as offsets, the first camera's [s] given; raises TrialError where one never sees `who` move."""
        unknown = [name for name, lag_s in zip(names, self.lag_s, strict=True) if not np.isfinite(lag_s)]
        if unknown:
            raise TrialError(f"{', '.join(unknown)}: never sees {who} move; synchronise by flash or sound")
        offset_s = first_s + self.lag_s
        return Offsets(tuple(names), offset_s, self.sd_s, self.drift, self.drift_sd, how=how, notes=tuple(notes))


def find_lags(measure: Callable[[Array, Array], LagEquations], lag_s: Array, *, with_drift: bool = False) -> CameraLags:
    """Iterate `measure(lag_s, drift)`, tracking with the current lags (c,), to convergence.

    The step of a single pass is too short; from the second pass on, the steps show by what factor (secant), which
    widens the sds too.
    """
    n = len(lag_s)
    x = np.concatenate([lag_s, np.zeros(n)])
    gain = np.full(2 * n, _GAIN)
    last: tuple[Array, Array] | None = None
    for _ in range(_MOST_PASSES):
        step, sd = solve_lags(measure(x[:n], x[n:]), with_drift=with_drift)
        step = np.nan_to_num(step)
        if last is not None:
            gain = _secant_gain(x - last[0], last[1] - step, gain)
        last = x, step
        x = x + gain * step
        if np.all(np.abs(step[:n]) < np.maximum(_CONVERGED_S, _CONVERGED_SDS * np.nan_to_num(sd[:n]))):
            break
    x, sd = np.where(np.isnan(sd), np.nan, x), gain * sd
    return CameraLags(x[:n], sd[:n], x[n:], sd[n:])


def _secant_gain(taken: Array, change: Array, gain: Array) -> Array:
    """Return by what factor each step is too short: what was taken by how much it changed the next one, else `gain`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        secant = np.where(np.abs(taken) > 3 * _CONVERGED_S, taken / change, gain)
    return np.clip(np.where(np.isfinite(secant) & (secant > 0), secant, gain), 1.0, _MOST_GAIN)
