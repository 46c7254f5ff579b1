"""How late each camera is, by its silhouettes in a run: with every other parameter open as far as is usual."""

from __future__ import annotations

import numpy as np

from airborne.cameras import Rig
from airborne.tracking.self_check.check import RunEquations
from airborne.tracking.self_check.nuisances import allow_cause, nuisances_of
from airborne.tracking.self_check.solution import N_BLOCKS
from airborne.types import Array

# what straight-line motion and constant biases leave open: the likeliest by the late cameras of 13 synthetic throws
_MODEL_SD_S = 0.0002


def camera_times(run: RunEquations, rig: Rig) -> tuple[Array, Array] | None:
    """Return how much later than stated each camera is, beyond the first one, and the sds: (c,) [s] twice.

    None where too little was registered, in any of the cameras.
    """
    is_seen = run.evidence.is_seen
    if not run.says_causes or len(is_seen) < 2 * N_BLOCKS or not is_seen.any(axis=0).all():
        return None
    prior = run.prior
    for nuisance in nuisances_of(rig):
        prior = allow_cause(prior, nuisance) if nuisance.kind == "time_s" else prior
    columns = np.array([nuisance.first for nuisance in nuisances_of(rig) if nuisance.kind == "time_s"])
    difference = np.eye(len(columns)) - np.eye(len(columns))[0]
    theta, covariance, _ = run.solution.posterior(prior)
    jackknife = run.solution.jackknife(prior)
    variance = [np.diag(difference @ each[np.ix_(columns, columns)] @ difference.T) for each in (covariance, jackknife)]
    sd = np.sqrt(np.max(variance, axis=0) + _MODEL_SD_S**2)
    sd[0] = 0.0
    return difference @ theta[columns], sd
