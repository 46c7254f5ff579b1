"""Which colours are skin, shoe or shorts: learned from one image, stored as bits beside each colour's bin.

A colour belongs to a class where its posterior against the rest of the image exceeds one half, with equal priors
(block-jump paper, section 2.2: "skin or shoe's color based recognition").
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import count_colours
from airborne.appearance.hue_saturation import CODES, bin_table
from airborne.tracking.particle.rods import CLASS_SHIFT
from airborne.types import Array32

_UNOBSERVED = 2e-5  # probability of an unobserved colour, per cell: a colour in neither histogram belongs to no class


def colour_counts(rgb: NDArray[np.uint8], mask: NDArray) -> Array32:
    """Count the masked pixels' colours, smoothed over neighbours: rgb (h, w, 3), mask (h, w) -> (32, 32, 32)."""
    counts = np.zeros((32, 32, 32), np.float32)
    count_colours(np.ascontiguousarray(rgb), mask, 1, counts)
    return counts


def code_table(class_counts: Sequence[NDArray], rest_counts: NDArray) -> NDArray[np.uint16]:
    """Return the code of every colour of 5 bits a channel: its bin, and a bit for each class that it belongs to.

    class_counts: the colour histogram (32, 32, 32) of each class; rest_counts: that of all other pixels. -> (32768,)
    """
    table = bin_table().copy()
    rest = _probabilities(rest_counts)
    for bit, counts in enumerate(class_counts):
        table |= ((_probabilities(counts) > rest).astype(np.uint16) << np.uint16(CLASS_SHIFT + bit)).astype(np.uint16)
    return table


def _probabilities(counts: NDArray) -> NDArray[np.floating]:
    return np.asarray(counts, float).reshape(CODES) / max(float(np.sum(counts)), 1.0) + _UNOBSERVED
