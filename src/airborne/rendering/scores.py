"""How well hypotheses agree with the pixels: root mean square colour differences, in grey levels (paper B, Method)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.body import SurfaceArrays
from airborne.kernels import kernel
from airborne.rendering.evidence import mask_evidence
from airborne.rendering.shapes import Shapes, new_shapes
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
    geometry: SurfaceArrays,
    targets: Targets,
    R: Array,
    t: Array,
    *,
    rule: ScoreRule = RULES["raw"],
    shapes: Shapes | None = None,
    threads: int = 1,
) -> Array:
    """Score n hypotheses against the views: (n,) [grey levels], smaller is better, infinite where no pixel is covered.

    R (n, s, 3, 3), t (n, s, 3) [m]: world from segment. Raw: sqrt(sum |RGB_observed - RGB_model|^2 / 3 pixels) over
    the model's mask, so a difference of d in each channel scores d. Normalised: the same of 255 RGB / (R + G + B),
    dark pixels left out; it does not depend on the lights. The result is the same for any number of threads. One
    thread may be given a workspace of `new_shapes`, which takes as long as half a hypothesis.
    """
    sums = colour_sums(geometry, targets, R, t, rule=rule, shapes=shapes, threads=threads)
    return scores_from_sums(sums, rule, count_missed_pixels(geometry, targets, R, t, rule=rule, threads=threads))


def count_missed_pixels(
    geometry: SurfaceArrays, targets: Targets, R: Array, t: Array, *, rule: ScoreRule, threads: int = 1
) -> NDArray[np.float64] | None:
    """Count the foreground outside the mask of each hypothesis in each view: (n, views); None if it does not count."""
    if not rule.counts_missed:
        return None
    assert targets.foreground is not None, "the rule counts missed foreground: give `pack_targets` the evidence"
    inside = mask_evidence(geometry, targets.foreground, R, t, threads=threads)
    return np.maximum(targets.foreground.totals - inside, 0)


def colour_sums(
    geometry: SurfaceArrays,
    targets: Targets,
    R: Array,
    t: Array,
    *,
    rule: ScoreRule,
    shapes: Shapes | None = None,
    threads: int = 1,
) -> NDArray[np.float64]:
    """Sum over the mask of each hypothesis in each view: (n, views, SUMS), columns as named in `sums`.

    With r = observed - model over the channels: pixels, sum r^2, sum r model, sum model^2; of chroma the number of
    coloured pixels and their sum of squared differences. What the rule does not use is zero.
    """
    R, t = np.ascontiguousarray(R, float), np.ascontiguousarray(t, float)
    out = np.empty((len(R), len(targets.views), SUMS))

    def fill(part: slice) -> None:
        sum_hypotheses(
            shapes or new_shapes(geometry),
            geometry,
            R[part],
            t[part],
            targets.views,
            targets.sizes,
            targets.lights if rule.normalised < 1 else None,
            targets.ambient,
            targets.images,
            rule.normalised > 0,
            out[part],
        )

    in_threads(fill, len(R), threads)
    return out


def scores_from_sums(sums: Array, rule: ScoreRule, missed: Array | None = None) -> Array:
    """Turn sums (n, views, SUMS), and the missed pixels (n, views), into scores (n,) [grey levels].

    The fitted gain is the least-squares a of |observed - a model|^2, kept within GAINS: |observed - a model|^2 is
    sum r^2 - (a - 1) (2 sum r model - (a - 1) sum model^2). Errors are pooled over pixels or views.
    """
    if missed is None:
        missed = np.zeros(sums.shape[:2])
    return _pool(sums, missed, rule.normalised, rule.fits_gain, rule.pool == "views")


@kernel
def _pool(sums, missed, normalised, fits_gain, is_by_view):
    out = np.zeros(len(sums))
    for h in range(len(sums)):
        for share, of_error, of_pixels in ((1 - normalised, ERROR, PIXELS), (normalised, CHROMA_ERROR, COLOURED)):
            if share == 0:
                continue
            squares, pixels, n_covered, mean, n_views = 0.0, 0.0, 0.0, 0.0, 0
            for i in range(sums.shape[1]):
                error = sums[h, i, of_error]
                if fits_gain and of_error == ERROR:
                    cross, model = sums[h, i, CROSS], sums[h, i, MODEL]
                    change = min(max(cross / max(model, 1e-9), GAINS[0] - 1), GAINS[1] - 1)
                    error = max(error - change * (2 * cross - change * model), 0.0)
                error += 3 * MISSED_GREY**2 * missed[h, i]
                counted = sums[h, i, of_pixels] + missed[h, i]
                squares, pixels, n_covered = squares + error, pixels + counted, n_covered + sums[h, i, of_pixels]
                mean, n_views = mean + np.sqrt(error / max(3 * counted, 1.0)), n_views + (counted > 0)
            rms = mean / max(n_views, 1) if is_by_view else np.sqrt(squares / max(3 * pixels, 1.0))
            out[h] += share * rms if n_covered > 0 else np.inf
    return out
