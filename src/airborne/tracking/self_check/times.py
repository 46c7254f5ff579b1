"""How late each camera is, by its silhouettes in a run: with every other parameter open as far as is usual."""

from __future__ import annotations

import numpy as np

from airborne.cameras import Rig
from airborne.tracking.self_check.check import RunEquations
from airborne.tracking.self_check.nuisances import nuisances_of, widen
from airborne.tracking.self_check.solution import NuisanceSolution, solve
from airborne.types import Array, Ints

# what straight-line motion and constant biases leave open: the likeliest by the late cameras of 13 synthetic throws
_MODEL_SD_S = 0.0002
_PARTS = 4  # of the run, each left out once: offsets that are wrong alike at neighbouring moments


def camera_times(run: RunEquations, rig: Rig) -> tuple[Array, Array] | None:
    """Return how much later than stated each camera is, beyond the first one, and the sds: (c,) [s] twice.

    None where too little was registered, in any of the cameras.
    """
    evidence = run.evidence
    n = len(evidence.offset)
    if not run.says_causes or n < 2 * _PARTS or not evidence.is_seen.any(axis=0).all():
        return None
    wide = prior = run.prior
    for nuisance in nuisances_of(rig):
        wide = widen(wide, nuisance)
        prior = widen(prior, nuisance) if nuisance.kind == "time_s" else prior
    columns = np.array([nuisance.first for nuisance in nuisances_of(rig) if nuisance.kind == "time_s"])
    later_s, variance = _beyond_first(run.solution, prior, columns)
    parts = np.arange(n) * _PARTS // n
    without = [
        _beyond_first(solve(evidence.select(parts != part), wide)[0], prior, columns)[0] for part in range(_PARTS)
    ]
    jackknife = (_PARTS - 1) * np.var(without, axis=0)
    sd = np.sqrt(np.maximum(variance, jackknife) + _MODEL_SD_S**2)
    sd[0] = 0.0
    return later_s, sd


def _beyond_first(solution: NuisanceSolution, prior: Array, columns: Ints) -> tuple[Array, Array]:
    """Return some parameters less the first of them, and the variances: (c,) twice."""
    theta, covariance, _ = solution.posterior(prior)
    difference = np.eye(len(columns)) - np.eye(len(columns))[0]
    variance = np.diag(difference @ covariance[np.ix_(columns, columns)] @ difference.T)
    return difference @ theta[columns], np.maximum(variance, 0)
