"""What the parts looked like in the first frame: histograms and classes of colours, learned in every camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.hue_saturation import BINS, bin_table, look_up, root_shares
from airborne.tracking.particle.colour_classes import code_table, colour_counts
from airborne.tracking.particle.image_regions import Region
from airborne.tracking.particle.rods import CLASS_SHIFT, count_rods, rod_corners

Array = NDArray[np.floating]

_CLASS_SETS = 8  # of three classes


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What is looked at: rods with their widths, and the classes of colours that each may show, as bits."""

    widths_m: Array  # (parts,)
    classes: NDArray[np.int64]  # (parts,)
    shown_by: tuple[tuple[int, ...], ...]  # for each class's bit, the parts that it is learned from


@dataclass(frozen=True, slots=True, eq=False)
class References:
    """What each camera saw of the parts in the first frame."""

    parts: Parts
    tables: tuple[NDArray[np.uint16], ...]  # per view: every colour's code (32768,)
    roots: NDArray[np.float32]  # (views, parts, 111): roots of the histograms' shares
    background_overlap: Array  # (views, parts): of the part's histogram with that of its surroundings
    background_share: Array  # (views, parts): of its classes in its surroundings


@dataclass(frozen=True, slots=True, eq=False)
class _Counts:
    rods: Array  # (parts, 111) bins of the rods' samples
    classes: tuple[Array, ...]  # (32, 32, 32) colours of each
    rest: Array  # (32, 32, 32) colours of what no rod covers


def learn(
    regions: Sequence[Region | None],
    ends: Array,
    parts: Parts,
    *,
    used: NDArray[np.bool_],
    drops_background: bool = False,
) -> References:
    """Learn the parts' colours from rods set by hand: ends (parts, 2, 3) [m]; used (parts, views) bool.

    Where a camera does not show a part, what the others saw of it together is taken; a part that is used in no camera
    is learned from all. At least one region must be there. With `drops_background` references leave out the colours
    commoner round the rods than in them: a rod that comes to show background is then less alike, wherever it was.
    """
    seen = [None if region is None else _counted(region, ends, parts) for region in regions]
    there = [counts for counts in seen if counts is not None]
    pooled = _Counts(
        np.zeros((len(ends), BINS + 1)),
        tuple(np.sum(same, axis=0) for same in zip(*[counts.classes for counts in there], strict=True)),
        np.sum([counts.rest for counts in there], axis=0),
    )
    is_there = np.array([counts is not None for counts in seen])
    used = used & is_there
    used = np.where(used.any(axis=1, keepdims=True), used, is_there).T[..., None]  # (views, parts, 1)
    by_view = [counts or pooled for counts in seen]
    rods = np.array([counts.rods for counts in by_view])
    rods = np.where(used, rods, np.sum(rods, axis=0, where=used))
    tables = tuple(code_table(counts.classes, counts.rest) for counts in by_view)
    rests = np.array([_by_class(counts.rest, table) for counts, table in zip(by_view, tables, strict=True)])
    if drops_background:
        rods = rods * (_shares(rods) > _shares(rests.sum(axis=1))[:, None])
    roots = root_shares(rods)
    belongs = (np.arange(_CLASS_SETS)[:, None] & parts.classes) != 0  # (sets, parts)
    return References(
        parts=parts,
        tables=tables,
        roots=roots,
        background_overlap=np.einsum("vpb,vb->vp", roots, root_shares(rests.sum(axis=1))),
        background_share=_shares(rests.sum(axis=2)) @ belongs,
    )


def _counted(region: Region, ends: Array, parts: Parts) -> _Counts:
    masks = [np.zeros(region.rgb.shape[:2], np.uint8) for _ in ends]
    corners = rod_corners(ends, region.projection, region.focal_px, parts.widths_m) - region.corner
    for mask, outline in zip(masks, corners, strict=True):
        if np.isfinite(outline).all():
            cv2.fillConvexPoly(mask, np.rint(outline).astype(np.int32), 1)
    rods = np.zeros((len(ends), BINS + 1))
    codes = look_up(region.rgb, bin_table())
    place = region.corner, region.projection, region.focal_px
    count_rods(codes, *place, np.ascontiguousarray(ends, float), parts.widths_m, rods)
    of_class = tuple(
        colour_counts(region.rgb, np.any([masks[part] for part in shown], axis=0)) for shown in parts.shown_by
    )
    return _Counts(rods, of_class, colour_counts(region.rgb, ~np.any(masks, axis=0)))


def _by_class(rest: Array, table: NDArray[np.uint16]) -> Array:
    """Return how often each set of classes and bin occurs in the surroundings: (8, 111)."""
    found = np.zeros((_CLASS_SETS, BINS + 1))
    np.add.at(found, (table >> CLASS_SHIFT, table & 255), np.asarray(rest, float).ravel())
    return found


def _shares(counts: Array) -> Array:
    return counts / np.maximum(counts.sum(axis=-1, keepdims=True), 1e-9)
