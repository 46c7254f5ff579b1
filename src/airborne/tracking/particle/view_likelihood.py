"""How alike a part and its references are over all cameras, in nats (block-jump paper, equation 6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

STIFFNESS = 20.0  # exp(-20 D²) for a Bhattacharyya distance D (Pérez et al. 2002)
LEAST_SHARE = 0.05  # the recognition's likelihood where no sample belongs to the class
SEEN = 0.9  # chance that a camera sees the part and not what stands before it, for the robust form


def detection(overlap: Array, stiffness: float = STIFFNESS) -> Array:
    """Return log L_HSVD of Bhattacharyya coefficients, 0 at best: exp(-stiffness D²) with D² = 1 - overlap."""
    return -stiffness * (1 - np.clip(overlap, 0, 1))


def recognition(share: Array) -> Array:
    """Return log L_HSVR of the share of samples that belong to the part's classes, 0 at best."""
    return np.log(LEAST_SHARE + (1 - LEAST_SHARE) * np.asarray(share))


def over_views(detected: Array, recognised: Array, used: NDArray[np.bool_]) -> Array:
    """Return equation 6: the product over cameras of detection plus that of recognition, as a log-likelihood.

    detected and recognised (..., views) [nat]; used (..., views): other views count as if they fitted perfectly.
    """
    return np.logaddexp(np.sum(detected, axis=-1, where=used), np.sum(recognised, axis=-1, where=used))


def unless_hidden(log_likelihood: Array, of_background: Array) -> Array:
    """Return the log of 0.9 L + 0.1 L_background: a camera that shows something else cannot rule a part out."""
    return np.logaddexp(np.log(SEEN) + log_likelihood, np.log(1 - SEEN) + of_background)
