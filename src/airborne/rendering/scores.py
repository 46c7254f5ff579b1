"""How well hypotheses agree with the pixels: root mean square colour differences, in grey levels (paper B, Method)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.body import SurfaceArrays
from airborne.rendering.evidence import mask_evidence
from airborne.rendering.shapes import new_shapes
from airborne.rendering.sums import CHROMA_ERROR, COLOURED, CROSS, ERROR, MODEL, PIXELS, SUMS, sum_hypotheses
from airborne.rendering.targets import Targets
from airborne.rendering.threads import in_threads
from airborne.types import Array

GAINS = (0.5, 2.0)  # bounds of the fitted gain: at gain zero a black body would fit any dark wall
MISSED_GREY = 64.0  # cost of a foreground pixel outside the mask, per channel: about the difference of a wrong colour


@dataclass(frozen=True, slots=True)
class ScoreRule:
    """How the sums over the mask become one number."""

    normalised: float = 0.0  # share of the chromaticity's difference in the score, 0..1; the rest is raw
    counts_missed: bool = False  # foreground outside the mask counts, MISSED_GREY each
    fits_gain: bool = False  # raw: the model's brightness is fitted in each view, for unknown light
    pool: Literal["pixels", "views"] = "pixels"  # every pixel counts the same, or every view


RULES = {
    "raw": ScoreRule(),
    "normalised": ScoreRule(normalised=1.0),
    "blend": ScoreRule(normalised=0.5),
    "union": ScoreRule(counts_missed=True),
}


def score(
    geometry: SurfaceArrays, targets: Targets, R: Array, t: Array, *, rule: ScoreRule = RULES["raw"], threads: int = 1
) -> Array:
    """Score n hypotheses against the views: (n,) [grey levels], smaller is better, infinite where no pixel is covered.

    R (n, s, 3, 3), t (n, s, 3) [m]: world from segment. Raw: sqrt(sum |RGB_observed - RGB_model|^2 / 3 pixels) over
    the model's mask, so a difference of d in each channel scores d. Normalised: the same of 255 RGB / (R + G + B),
    dark pixels left out; it does not depend on the lights. The result is the same for any number of threads.
    """
    if rule.counts_missed:
        assert targets.foreground is not None, "the rule counts missed foreground: give `pack_targets` the evidence"
    sums = colour_sums(geometry, targets, R, t, with_chroma=rule.normalised > 0, threads=threads)
    missed = None
    if rule.counts_missed and targets.foreground is not None:
        inside = mask_evidence(geometry, targets.foreground, R, t, threads=threads)
        missed = np.maximum(targets.foreground.totals - inside, 0)
    return scores_from_sums(sums, rule, missed)


def colour_sums(
    geometry: SurfaceArrays, targets: Targets, R: Array, t: Array, *, with_chroma: bool, threads: int = 1
) -> NDArray[np.float64]:
    """Sum over the mask of each hypothesis in each view: (n, views, SUMS), columns as named in `sums`.

    With r = observed - model over the channels: pixels, sum r^2, sum r model, sum model^2; with chroma also the
    number of coloured pixels and their sum of squared differences.
    """
    R, t = np.ascontiguousarray(R, float), np.ascontiguousarray(t, float)
    out = np.empty((len(R), len(targets.views), SUMS))

    def fill(part: slice) -> None:
        sum_hypotheses(
            new_shapes(geometry),
            geometry,
            R[part],
            t[part],
            targets.views,
            targets.sizes,
            targets.lights,
            targets.ambient,
            targets.images,
            with_chroma,
            out[part],
        )

    in_threads(fill, len(R), threads)
    return out


def scores_from_sums(sums: Array, rule: ScoreRule, missed: Array | None = None) -> Array:
    """Turn sums (n, views, SUMS), and the missed pixels (n, views), into scores (n,) [grey levels].

    The fitted gain is the least-squares a of |observed - a model|^2, kept within GAINS: |observed - a model|^2 is
    sum r^2 - (a - 1) (2 sum r model - (a - 1) sum model^2).
    """
    raw = sums[..., ERROR]
    if rule.fits_gain:
        change = np.clip(sums[..., CROSS] / np.maximum(sums[..., MODEL], 1e-9), GAINS[0] - 1, GAINS[1] - 1)
        raw = np.maximum(raw - change * (2 * sums[..., CROSS] - change * sums[..., MODEL]), 0)
    result = np.zeros(len(sums))
    if rule.normalised < 1:
        result += (1 - rule.normalised) * _rms(raw, sums[..., PIXELS], rule, missed)
    if rule.normalised > 0:
        result += rule.normalised * _rms(sums[..., CHROMA_ERROR], sums[..., COLOURED], rule, missed)
    return result


def _rms(error: Array, pixels: Array, rule: ScoreRule, missed: Array | None) -> Array:
    """Pool squared errors (n, views) over pixels or views; infinite where a hypothesis shows no pixel."""
    is_covered = pixels.sum(axis=1) > 0
    if missed is not None:
        error, pixels = error + 3 * MISSED_GREY**2 * missed, pixels + missed
    if rule.pool == "pixels":
        rms = np.sqrt(error.sum(axis=1) / np.maximum(3 * pixels.sum(axis=1), 1))
    else:
        counted = pixels > 0
        per_view = np.sqrt(error / np.maximum(3 * pixels, 1))
        rms = per_view.sum(axis=1) / np.maximum(counted.sum(axis=1), 1)
    return np.where(is_covered, rms, np.inf)
