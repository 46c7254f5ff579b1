"""How late each camera is, by its silhouettes in a run: with every other parameter open as far as is usual."""

from __future__ import annotations

import numpy as np

from airborne.cameras import Rig
from airborne.tracking.self_check.check import RunEquations
from airborne.tracking.self_check.nuisances import nuisances_of, widen
from airborne.types import Array

_MODEL_SD_S = 0.0003  # what straight-line motion and constant biases leave open


def camera_times(run: RunEquations, rig: Rig) -> tuple[Array, Array] | None:
    """Return how much later than stated each camera is, beyond the first one, and the sds: (c,) [s] twice.

    None where too little was registered, in any of the cameras.
    """
    if not run.says_causes or not run.evidence.is_seen.any(axis=0).all():
        return None
    times, prior = [nuisance for nuisance in nuisances_of(rig) if nuisance.kind == "time_s"], run.prior
    for nuisance in times:
        prior = widen(prior, nuisance)
    theta, covariance, _ = run.solution.posterior(prior)
    columns = np.array([nuisance.first for nuisance in times])
    difference = np.eye(len(times)) - np.eye(len(times))[0]
    variance = np.diag(difference @ covariance[np.ix_(columns, columns)] @ difference.T)
    sd = np.hypot(np.sqrt(np.maximum(variance, 0)), _MODEL_SD_S)
    sd[0] = 0.0
    return difference @ theta[columns], sd
