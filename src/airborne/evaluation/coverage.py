"""Coverage of stated intervals: how often they hold the error, against how often they should."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from airborne.types import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """Shares of errors inside intervals that state 50, 80 and 95 %; NaN for n = 0."""

    within_50: float
    within_80: float
    within_95: float
    ece: float  # expected calibration error: the mean distance of the three shares from what they state
    n: int  # errors with a finite standard deviation

    def describe(self, errors: str) -> str:
        """Return the numbers of what they were counted for in a line."""
        return (
            f"intervals of 50, 80, 95% hold {self.within_50:.0%}, {self.within_80:.0%}, {self.within_95:.0%} of the "
            f"{errors} (ECE {self.ece:.3f}), n = {self.n}"
        )


def coverage_of(error: Array, sd: Array) -> Coverage:
    """Count normal errors within their stated intervals; arrays of one shape, those without a finite sd left out."""
    is_known = np.isfinite(sd) & np.isfinite(error)
    error, sd = np.abs(error[is_known]), sd[is_known]
    if not len(error):
        return Coverage(within_50=math.nan, within_80=math.nan, within_95=math.nan, ece=math.nan, n=0)
    stated = np.array([0.5, 0.8, 0.95])
    shares = np.array([np.mean(error <= ndtri(0.5 + level / 2) * sd) for level in stated])
    within_50, within_80, within_95 = shares.tolist()
    return Coverage(
        within_50=within_50,
        within_80=within_80,
        within_95=within_95,
        ece=float(np.abs(shares - stated).mean()),
        n=len(error),
    )
