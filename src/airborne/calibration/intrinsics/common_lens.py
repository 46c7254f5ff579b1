"""Cameras that may be of one make: where each would stand with the lens that is common to them. Arrays only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from airborne.calibration.intrinsics.model_selection import Solution, choose_simplest
from airborne.calibration.intrinsics.physical import FISHEYE_MODELS, WIDE_MODELS, fit_pinhole_pose
from airborne.types import Array

_MODEL = FISHEYE_MODELS[1]  # of the common lens: few terms that suit most wide lenses
_FEWEST = 3  # cameras of one size that have a common lens
_PLAUSIBLE = 2.0  # times a camera's own left-out error: what the common lens may leave


def common_lens_sd(
    candidates: Mapping[str, Sequence[Solution]], sizes: Mapping[str, tuple[int, int]]
) -> dict[str, Array]:
    """Return by camera how far its centre moves (3,) [m] with the median lens of the wide cameras of its size.

    RMS over the cameras that this lens suits, in each one's own axes, turned to the world's; the others have none. What
    a lens and a place exchange without a trace in the pixels shows here; it is a part of the place's uncertainty.
    """
    sd = {}
    for size in set(sizes.values()):
        own = {
            name: next((s for s in each if s.model is _MODEL), None)
            for name, each in candidates.items()
            if sizes[name] == size and choose_simplest(each).model in WIDE_MODELS
        }
        fits = {name: fit.pinhole for name, fit in own.items() if fit is not None}
        if len(fits) < _FEWEST:
            continue
        focal = float(np.median([fit.focal_px for fit in fits.values()]))
        middle = np.median([fit.principal_point for fit in fits.values()], axis=0)
        terms = np.median([fit.terms for fit in fits.values()], axis=0)
        shifts = {}
        for name, fit in fits.items():
            chosen = choose_simplest(candidates[name])
            start = replace(fit, focal_px=focal, principal_point=middle, terms=terms)
            common = fit_pinhole_pose(start, chosen.world, chosen.px)
            rms = np.sqrt(np.mean((common.px_from_world(chosen.world) - chosen.px) ** 2))
            if rms < _PLAUSIBLE * np.sqrt(np.mean(chosen.held_out_px**2)):
                shifts[name] = chosen.pinhole.R @ (common.centre - chosen.pinhole.centre)
        variance = np.mean(np.square(list(shifts.values())), axis=0) if shifts else np.zeros(3)
        sd |= {name: np.sqrt(fits[name].R.T ** 2 @ variance) for name in shifts}
    return sd
