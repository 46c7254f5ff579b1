"""Similarity of a part and its references over all cameras, in nats (block-jump paper, equation 6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.types import Floats

STIFFNESS = 20.0  # exp(-20 D²) for a Bhattacharyya distance D (Pérez et al. 2002)
LEAST_CLASS_SHARE = 0.05  # the recognition's likelihood where no sample belongs to the class
_VISIBLE_CHANCE = 0.9  # probability that a camera sees the part and not an occluder, for the robust form


def detection(overlap: Floats, stiffness: float = STIFFNESS) -> Floats:
    """Return log L_HSVD of Bhattacharyya coefficients, 0 at best: exp(-stiffness D²) with D² = 1 - overlap."""
    return -stiffness * (1 - np.clip(overlap, 0, 1))


def recognition(share: Floats) -> Floats:
    """Return log L_HSVR of the share of samples that belong to the part's classes, 0 at best."""
    return np.log(LEAST_CLASS_SHARE + (1 - LEAST_CLASS_SHARE) * np.asarray(share))


def combine_views(detected: Floats, recognised: Floats, used: NDArray[np.bool_]) -> Floats:
    """Return equation 6: the product over cameras of detection plus that of recognition, as a log-likelihood.

    detected and recognised (..., views) [nat]; used (..., views): other views contribute 0.
    """
    return np.logaddexp(np.sum(detected, axis=-1, where=used), np.sum(recognised, axis=-1, where=used))


def mix_with_background(log_likelihood: Floats, background: Floats) -> Floats:
    """Return log(0.9 L + 0.1 L_background): a camera that shows something else cannot rule a part out."""
    return np.logaddexp(np.log(_VISIBLE_CHANCE) + log_likelihood, np.log(1 - _VISIBLE_CHANCE) + background)
