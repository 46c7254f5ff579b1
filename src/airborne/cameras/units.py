"""Checks of the unit of length: rigs too large or too small for metres, and sources with different scales."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from airborne.cameras.camera import Rig
from airborne.cameras.finding import Finding

FARTHEST_M, _NEAREST_M = 200.0, 0.05  # where the largest distance between two cameras is in metres
_UNIT_NAMES = {1000.0: "mm", 100.0: "cm", 10.0: "dm", 1 / 0.0254: "inches", 1 / 0.3048: "feet"}  # in a metre
_UNIT_TOLERANCE = 0.08  # relative distance of a ratio from a unit's
_SCALE_TOLERANCE = 0.15  # relative difference of two scales that is reported


def check_baselines(rig: Rig) -> list[Finding]:
    """Report cameras that stand implausibly far apart or near to each other."""
    longest_m = longest_baseline_m(rig)
    if len(rig) < 2 or _NEAREST_M <= longest_m <= FARTHEST_M:
        return []
    return [
        Finding(
            kind="units",
            what=f"the cameras come out {longest_m:{'.3g' if longest_m < 1 else '.0f'}} m apart at most",
            advice="a length is not in metres: check square_m, the wand's length and the coordinates (mm / 1000 = m)",
        )
    ]


def longest_baseline_m(rig: Rig) -> float:
    """Return the largest distance between two cameras [m]; 0 for a single one."""
    return max((float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(rig, 2)), default=0.0)


def check_scales(starts: Mapping[str, Rig]) -> list[Finding]:
    """Report sources with different distances between the same cameras; starts: the initial rig of each source."""
    findings = []
    for (one, rig), (other, rig_other) in combinations(starts.items(), 2):
        ratio = _scale_ratio(rig, rig_other)
        if not np.isfinite(ratio) or abs(ratio - 1) <= _SCALE_TOLERANCE:
            continue
        larger, smaller, ratio = (one, other, ratio) if ratio > 1 else (other, one, 1 / ratio)
        unit = next((name for value, name in _UNIT_NAMES.items() if abs(ratio / value - 1) < _UNIT_TOLERANCE), None)
        guess = f"the lengths of the {larger} seem to be in {unit}; give metres" if unit else "one length is wrong"
        findings.append(
            Finding(
                kind="units",
                what=f"cameras are {ratio:.3g} times as far apart by the {larger} as by the {smaller}",
                advice=f"{guess}; measure both again",
            )
        )
    return findings


def _scale_ratio(rig: Rig, other: Rig) -> float:
    """Return the median ratio of distances between the cameras that both hold; NaN for fewer than two."""
    shared = [name for name in rig.names if name in other.names]
    ratios = [
        np.linalg.norm(rig[a].centre - rig[b].centre) / np.linalg.norm(other[a].centre - other[b].centre)
        for a, b in combinations(shared, 2)
    ]
    return float(np.median(ratios)) if ratios else float("nan")
