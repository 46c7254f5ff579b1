"""Statistical parametric mapping: where along a curve two conditions differ, by the package *spm1d*.

Pataky 2012, "One-dimensional statistical parametric mapping in Python": Student's t at every node, and a threshold that
the smooth noise of a whole curve exceeds with probability alpha.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.errors import INSTALL_EXTRA, AirborneError
from airborne.study.random_effects import Difference
from airborne.types import Array, Mask

_FEWEST_NODES = 5  # of a curve that can be tested
NOT_TESTED = "could not be tested: too few, or all the same"
_FEWEST = 3  # athletes or trials a sample: residuals need some


@dataclass(frozen=True, slots=True, eq=False)
class CurveTest:
    """Student's t along a curve, its threshold, and the stretches where it is exceeded."""

    t: Array  # (nodes,), NaN where all values are the same
    threshold: float  # NaN where nothing could be tested
    clusters: tuple[tuple[float, float, float], ...]  # first and last node, p


def format_p(p: float) -> str:
    """Return a p-value as studies print it."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def check_spm1d() -> None:
    """Raise AirborneError where *spm1d* is not installed."""
    try:
        import spm1d as spm1d
    except ImportError:
        raise AirborneError(f"comparing curves needs spm1d, {INSTALL_EXTRA.format('batch')}") from None


def compare_curves(difference: Difference, alpha: float) -> CurveTest:
    """Test a difference of curves, two-sided: paired within athletes, else Welch's test of two samples."""
    from spm1d.stats import ttest2, ttest_paired

    a, b = difference.samples
    nodes = a.shape[1]
    t = np.full(nodes, np.nan)
    tested = _longest_run(_varies(b - a) if difference.level == "within athletes" else _varies(a) | _varies(b))
    if min(len(a), len(b)) < _FEWEST or len(tested) < _FEWEST_NODES:
        return CurveTest(t, np.nan, ())
    a, b = a[:, tested], b[:, tested]
    found = ttest_paired(b, a) if difference.level == "within athletes" else ttest2(b, a, equal_var=False)
    inference: Any = found.inference(alpha, two_tailed=True)
    t[tested] = inference.z
    clusters = [(tested[0] + each.endpoints[0], tested[0] + each.endpoints[1], each.P) for each in inference.clusters]
    return CurveTest(t, float(inference.zstar), tuple((float(low), float(high), float(p)) for low, high, p in clusters))


def _varies(values: Array) -> Mask:
    return np.ptp(values, axis=0) > 0


def _longest_run(mask: Mask) -> NDArray[np.intp]:
    """Return the indices of the longest run of a mask (nodes,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]))).reshape(-1, 2)
    first, last = max(edges, key=lambda edge: edge[1] - edge[0], default=(0, 0))
    return np.arange(first, last)
