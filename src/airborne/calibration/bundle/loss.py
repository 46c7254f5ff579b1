"""Robust losses of pixel distances, and their scale and efficiency under normal errors. Arrays only."""

from __future__ import annotations

from functools import cache
from typing import Literal, NamedTuple

import numpy as np

from airborne.types import Array

Loss = Literal["cauchy", "huber", "squares"]

_CAUCHY, _HUBER = 2.4, 1.5  # tuning constants in standard deviations; 95 % efficient under normal errors
_N_QUANTILES = 100_000  # at which the expected squared distance is summed
BEHIND_CAMERA = 1e4  # squared distance, in standard deviations, of a point behind its camera


def robust_cost(loss: Loss, s: Array) -> Array:
    """Return the loss of squared distances s, in standard deviations."""
    if loss == "cauchy":
        return _CAUCHY**2 * np.log1p(s / _CAUCHY**2)
    if loss == "huber":
        return np.where(s <= _HUBER**2, s, 2 * _HUBER * np.sqrt(s) - _HUBER**2)
    return s


def robust_weight(loss: Loss, s: Array) -> Array:
    """Return the derivative of the loss: 1 for small distances, falling with them."""
    if loss == "cauchy":
        return 1 / (1 + s / _CAUCHY**2)
    if loss == "huber":
        return np.minimum(1.0, _HUBER / np.sqrt(np.maximum(s, 1e-12)))
    return np.ones_like(s)


class LossConstants(NamedTuple):
    """Constants of a loss under normal errors in two coordinates."""

    scale: float  # mean of weight times squared coordinate, in variances
    variance: float  # of the estimate, as a multiple of the inverse weighted information
    clustered: float  # the same of the sandwich of weighted scores


@cache
def loss_constants(loss: Loss) -> LossConstants:
    """Return the constants of a loss, over the quantiles of the squared distance of two normal coordinates.

    With the influence function `psi = w r`: variance `E[psi^2] / E[psi']^2` (Huber 1964), and E[w] for the weights in
    the information matrix.
    """
    s = -2 * np.log1p(-(np.arange(_N_QUANTILES) + 0.5) / _N_QUANTILES)
    w = robust_weight(loss, s)
    above, below = s + 1e-5 * (1 + s), np.maximum(s - 1e-5 * (1 + s), 0)
    derivative = (robust_weight(loss, above) - robust_weight(loss, below)) / (above - below)
    mean_w, influence, sharpness = np.mean(w), np.mean(w * w * s) / 2, np.mean(w + s * derivative)
    return LossConstants(
        scale=float(np.mean(w * s) / 2),
        variance=float(mean_w * influence / sharpness**2),
        clustered=float((mean_w / sharpness) ** 2),
    )


def robust_scale(loss: Loss, s: Array) -> float:
    """Return the factor k of the assumed standard deviations, an M-estimate of scale; s (n,) squared distances in them.

    Solves `mean(w(s / k^2) s / k^2) = E` for k, with E its value under normal errors, starting from the median.
    """
    expected = 2 * loss_constants(loss).scale * len(s)
    k2 = max(float(np.median(s)) / (2 * np.log(2)), 1e-12)
    for _ in range(100):
        new = max(float(np.sum(robust_weight(loss, s / k2) * s)) / expected, 1e-12)
        if abs(new / k2 - 1) < 1e-6:
            break
        k2 = new
    return float(np.sqrt(k2))
