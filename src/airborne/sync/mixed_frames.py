"""Blended frames, as frame-rate converters make them from two instants: how much of each instant they show.

A tracker takes one of the two half-transparent bodies for the body. Here the body is rendered at many instants around
the frame's own, and each one's share is estimated by least squares over all frames of a camera. Blending is assumed to
act on the file's own values, as converters do. Arrays but for `blend_equations`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import nnls

from airborne.appearance.model import Appearance, Region
from airborne.body import PosedBody
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array

_SIGMA_PX = 2.0  # of a full frame
_RIDGE = 1e-9  # of the mean curvature
_GROUPS = 8  # left out in turn, for the jackknife
_SECOND_BODY = 0.05  # a larger share inside, beside the largest one and its neighbours, is a second body


@dataclass(frozen=True, slots=True, eq=False)
class Blend:
    """The shares of the body at m instants in a camera's frames; NaN where it was never visible."""

    lag_s: Array  # (m,) of the instants after the frames' times
    share: Array  # (m,) sums to 1
    centre_s: float  # mean lag, weighted by the shares
    sd_s: float  # of the centre

    @property
    def is_mixed(self) -> bool:
        """Whether the frames show two bodies, more than one step of the instants apart.

        The shares of the first and last instant do not count: the body is farthest from where it is then, so that they
        take what no body explains, as its shadow.
        """
        if not np.isfinite(self.centre_s):
            return False
        is_beside = np.abs(np.arange(len(self.share)) - int(self.share.argmax())) > 1
        return float(self.share[1:-1][is_beside[1:-1]].sum()) > _SECOND_BODY


def blend_equations(
    render_model: RenderModel, appearance: Appearance, region: Region, bodies: Sequence[PosedBody]
) -> tuple[Array, Array]:
    """Return the normal equations (m, m), (m,) for the shares of m posed bodies in a region's image.

    The bodies have their own colours, unlit: a wrong brightness scales all shares alike.
    """
    mean, _, n_observations = appearance.background_pixels(region)
    is_learned = (n_observations > 0)[..., None]
    differences = []
    for posed in bodies:
        part = render_model.draw_parts(posed, region)
        colours = render_model.geometry.colours[np.maximum(part, 0)]
        differences.append(_smooth(np.where(is_learned & (part >= 0)[..., None], colours - mean, 0), region.aspect))
    observed = _smooth(np.where(is_learned, region.rgb - mean, 0), region.aspect)
    rows = np.stack(differences)
    return rows @ rows.T, rows @ observed


def blend_of(lag_s: Array, A: Array, b: Array) -> Blend:
    """Estimate the shares of the instants lag_s (m,) from the equations (n, m, m), (n, m) of n frames in order.

    The centre's sd is the jackknife's over groups of successive frames.
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
