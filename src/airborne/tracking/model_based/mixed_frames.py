"""Pictures mixed from two moments, as converters of frame rates make them: how much of each moment they show.

A tracker takes one of the two half-transparent bodies for the body. Here the body is drawn at many moments about the
picture's own, and what of each is in the picture is found by least squares over all pictures of a camera. Mixing is
taken to be done in the file's own values, as converters do. Arrays but for `moment_equations`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from airborne.appearance.model import Appearance, Region
from airborne.body import PosedBody
from airborne.tracking.model_based.render_model import Synthesis

Array = NDArray[np.floating]

_SIGMA_PX = 2.0  # of a full frame
_RIDGE = 1e-9  # of the mean curvature
_GROUPS = 8  # left out in turn for the sd
_BESIDE = 0.05  # a larger share beside the moment that shows most, and its neighbours, is another body


@dataclass(frozen=True, slots=True, eq=False)
class Blend:
    """How much of the body at m moments is in a camera's pictures; NaN where it never was seen."""

    lag_s: Array  # (m,) of the moments, after the pictures' times
    share: Array  # (m,) sums to 1
    centre_s: float  # mean lag, weighted by the shares
    sd_s: float  # of the centre

    @property
    def is_mixed(self) -> bool:
        """Whether the pictures show two bodies, more than a step of the moments apart."""
        if not np.isfinite(self.centre_s):
            return False
        top = int(self.share.argmax())
        return float(self.share[max(top - 1, 0) : top + 2].sum()) < 1 - _BESIDE


def moment_equations(
    synthesis: Synthesis, appearance: Appearance, region: Region, bodies: Sequence[PosedBody]
) -> tuple[Array, Array]:
    """Return the normal equations (m, m), (m,) of how much of each of m placed bodies a region's picture shows.

    The bodies are painted in their own colours, unlit: a brightness that is off changes all shares alike.
    """
    mean, _, looks = appearance.scene(region)
    is_known = (looks > 0)[..., None]
    drawn = []
    for posed in bodies:
        part = synthesis.parts(posed, region)
        colours = synthesis.geometry.colours[np.maximum(part, 0)]
        drawn.append(_smooth(np.where(is_known & (part >= 0)[..., None], colours - mean, 0), region.aspect))
    seen = _smooth(np.where(is_known, region.rgb - mean, 0), region.aspect)
    rows = np.stack(drawn)
    return rows @ rows.T, rows @ seen


def blend_of(lag_s: Array, A: Array, b: Array) -> Blend:
    """Find the shares of the moments lag_s (m,) from the equations (n, m, m), (n, m) of n pictures, one after another.

    The centre's sd is the jackknife's over stretches of the pictures.
    """
    unknown = Blend(lag_s, np.full(len(lag_s), np.nan), np.nan, np.nan)
    if len(A) < _GROUPS:
        return unknown
    shares = _shares(A.sum(axis=0), b.sum(axis=0))
    if shares.sum() <= 0:
        return unknown
    group = np.arange(len(A)) * _GROUPS // len(A)
    without = [_shares(A[group != g].sum(axis=0), b[group != g].sum(axis=0)) for g in range(_GROUPS)]
    centres = np.array([lag_s @ each / max(each.sum(), 1e-12) for each in without])
    sd_s = float(np.sqrt((_GROUPS - 1) * centres.var()))
    return Blend(lag_s, shares / shares.sum(), float(lag_s @ shares / shares.sum()), sd_s)


def _shares(A: Array, b: Array) -> Array:
    """Solve A x = b in the least-squares sense for x >= 0."""
    L = np.linalg.cholesky(A + (_RIDGE * np.trace(A) / len(A) + np.finfo(float).tiny) * np.eye(len(A)))
    return nnls(L.T, np.linalg.solve(L, b))[0]


def _smooth(rgb: Array, aspect: float) -> Array:
    rows_sigma = max(_SIGMA_PX * aspect, 0.5)
    return np.asarray(cv2.GaussianBlur(rgb.astype(np.float32), (0, 0), _SIGMA_PX, sigmaY=rows_sigma), float).ravel()
