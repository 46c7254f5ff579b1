"""Which surface classes of a player are hidden in which camera, as the evidence of a fit tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.capsules.jumper import CAPSULES, SKIN, SURFACE_CLASSES
from airborne.tracking.capsules.surface_colours import SurfaceColours, occlusion_chance
from airborne.tracking.capsules.track import Track
from airborne.tracking.capsules.views import EvidenceTable
from airborne.types import Array

# chosen by hand on synthetic blocks: without it joints err by 21.2 mm, with it by 20.9: blocker_variants.csv
_OCCLUDED = 0.45  # mean probability of occlusion, of all classes or of the legs', above which a view does not count
_LEAST_AREA_PX = 8.0  # of a class in a map, to judge its occlusion
_OCCLUSION_RATE, _OCCLUSION_STEP = 0.3, 0.08  # of the newest frame; a smaller change leaves the tables as they are
# (classes, halves of capsules)
_HALVES_OF_CLASS = (CAPSULES[:, :2].ravel() == np.arange(len(SURFACE_CLASSES))[:, None]).astype(float)


def evidence_tables(colours: SurfaceColours) -> tuple[EvidenceTable, ...]:
    """Return the tables of all cameras."""
    return tuple(colours.table(view) for view in range(len(colours.occlusion)))


def with_occlusion(track: Track, occlusion: Array) -> Track:
    """Set the occlusion; a camera's table is recomputed only where that changes it."""
    colours = replace(track.colours, occlusion=occlusion)
    tables = tuple(
        colours.table(view) if np.abs(occlusion[view] - table.occlusion).max() > _OCCLUSION_STEP else table
        for view, table in enumerate(track.tables)
    )
    return replace(track, colours=colours, tables=tables)


def update_occlusion(track: Track, owned: Array, views: Sequence[int]) -> Array:
    """Update which classes are occluded in which view, by the evidence of the fit there."""
    occlusion = track.colours.occlusion.copy()
    by_class = _HALVES_OF_CLASS @ owned.reshape(len(owned), -1, 2)  # (views, classes, 2)
    for view, (evidence, area) in zip(views, by_class.swapaxes(1, 2), strict=True):
        target = occlusion_chance(evidence / np.maximum(area, 1e-9), track.tables[view].expected)
        occlusion[view] += _OCCLUSION_RATE * np.where(area > _LEAST_AREA_PX, target - occlusion[view], 0)
    return occlusion


def shows_player(occlusion: Array) -> NDArray[np.bool_]:
    """Return in which views (v,) neither the player nor the legs alone are occluded: occlusion (v, 5)."""
    return np.maximum(occlusion.mean(axis=1), occlusion[:, SKIN:].mean(axis=1)) < _OCCLUDED


def count_unoccluded(occlusion: Array, views: Sequence[int]) -> int:
    """Count those of some views in which neither the player nor the legs alone are occluded."""
    return int(np.sum(shows_player(occlusion)[list(views)]))
