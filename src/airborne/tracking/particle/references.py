"""Reference appearance of the parts: colour histograms and colour classes, learned in every camera's first frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.hue_saturation import HSV_BINS, bin_table, look_up, root_histograms
from airborne.tracking.particle.colour_classes import code_table, colour_counts
from airborne.tracking.particle.image_regions import ImageRegion
from airborne.tracking.particle.rods import CLASS_SHIFT, count_rods, rod_corners
from airborne.types import Array, Array32

_CLASS_SETS = 8  # of three classes


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The parts that are observed: rods with their widths, and the colour classes that each may show, as bits."""

    widths_m: Array  # (parts,)
    classes: NDArray[np.int64]  # (parts,)
    learned_from: tuple[tuple[int, ...], ...]  # for each class's bit, the parts that it is learned from


@dataclass(frozen=True, slots=True, eq=False)
class References:
    """Each camera's references of the parts."""

    parts: Parts
    tables: tuple[NDArray[np.uint16], ...]  # per view: every colour's code (32768,)
    roots: Array32  # (views, parts, 111): square roots of the normalised histograms
    background_overlap: Array  # (views, parts): of each part's histogram with that of the background
    background_share: Array  # (views, parts): of its classes in the background


@dataclass(frozen=True, slots=True, eq=False)
class _Counts:
    rods: Array  # (parts, 111) histograms of the rods' samples
    classes: tuple[Array32, ...]  # (32, 32, 32) each, colour histograms
    rest: Array32  # (32, 32, 32) colour histogram of what no rod covers


def learn_references(
    regions: Sequence[ImageRegion | None],
    ends: Array,
    parts: Parts,
    *,
    used: NDArray[np.bool_],
    drops_background: bool = False,
) -> References:
    """Learn the parts' colours from hand-set rods: ends (parts, 2, 3) [m]; used (parts, views) bool.

    A camera that does not show a part takes the other cameras' pooled histogram; a part that is used in no camera is
    learned from all. At least one region is required. With `drops_background` references leave out the colours that
    are more frequent around the rods than in them: a rod that drifts onto the background then matches less well.
    """
    by_region = [None if region is None else _count_region(region, ends, parts) for region in regions]
    available = [counts for counts in by_region if counts is not None]
    pooled = _Counts(
        np.zeros((len(ends), HSV_BINS + 1)),
        tuple(np.sum(same, axis=0) for same in zip(*[counts.classes for counts in available], strict=True)),
        np.sum([counts.rest for counts in available], axis=0),
    )
    has_region = np.array([counts is not None for counts in by_region])
    used = used & has_region
    used = np.where(used.any(axis=1, keepdims=True), used, has_region).T[..., None]  # (views, parts, 1)
    by_view = [counts or pooled for counts in by_region]
    rods = np.array([counts.rods for counts in by_view])
    rods = np.where(used, rods, np.sum(rods, axis=0, where=used))
    tables = tuple(code_table(counts.classes, counts.rest) for counts in by_view)
    rests = np.array([_by_class(counts.rest, table) for counts, table in zip(by_view, tables, strict=True)])
    if drops_background:
        rods = rods * (_normalise(rods) > _normalise(rests.sum(axis=1))[:, None])
    roots = root_histograms(rods)
    belongs = (np.arange(_CLASS_SETS)[:, None] & parts.classes) != 0  # (sets, parts)
    return References(
        parts=parts,
        tables=tables,
        roots=roots,
        background_overlap=np.einsum("vpb,vb->vp", roots, root_histograms(rests.sum(axis=1))),
        background_share=_normalise(rests.sum(axis=2)) @ belongs,
    )


def _count_region(region: ImageRegion, ends: Array, parts: Parts) -> _Counts:
    masks = [np.zeros(region.rgb.shape[:2], np.uint8) for _ in ends]
    corners = rod_corners(ends, region.projection, region.focal_px, parts.widths_m) - region.corner
    for mask, outline in zip(masks, corners, strict=True):
        if np.isfinite(outline).all():
            cv2.fillConvexPoly(mask, np.rint(outline).astype(np.int32), 1)
    rods = np.zeros((len(ends), HSV_BINS + 1))
    codes = look_up(region.rgb, bin_table())
    camera = region.corner, region.projection, region.focal_px
    count_rods(codes, *camera, np.ascontiguousarray(ends, float), parts.widths_m, rods)
    classes = tuple(
        colour_counts(region.rgb, np.any([masks[part] for part in part_numbers], axis=0))
        for part_numbers in parts.learned_from
    )
    return _Counts(rods, classes, colour_counts(region.rgb, ~np.any(masks, axis=0)))


def _by_class(rest: Array32, table: NDArray[np.uint16]) -> Array:
    """Return how often each set of classes and each bin occurs in the background: (8, 111)."""
    counts = np.zeros((_CLASS_SETS, HSV_BINS + 1))
    np.add.at(counts, (table >> CLASS_SHIFT, table & 255), np.asarray(rest, float).ravel())
    return counts


def _normalise(counts: Array) -> Array:
    return counts / np.maximum(counts.sum(axis=-1, keepdims=True), 1e-9)
