"""Where something moves: regions that stand out in each view, matched over the cameras by their rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.empty_scene import PIXEL_EVIDENCE_LIMIT
from airborne.cameras import Camera, Rig
from airborne.tracking.first_pose.moments import Moment
from airborne.types import Array, Array32, Mask

_LEAST_SHARE = 1e-4  # of the picture that a region covers
_MOST_REGIONS = 6  # of a view, the largest
NEAREST_M = 0.1  # chosen: to a camera that sees a place
_APART = 0.7  # body radii by which rays of one body's regions may miss each other


@dataclass(frozen=True, slots=True, eq=False)
class MovingRegion:
    """A connected region that stands out in one view."""

    camera: Camera
    centre: Array  # (2,) [px], by evidence
    area_px: float  # of what stands out in it [px]
    is_cut: bool  # by the picture's border
    corner: tuple[int, int]  # of its box, left and upper [px]
    mask: Mask  # (h, w) of its box


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where regions of several views agree that something moves."""

    position: Array  # (3,) world [m]
    regions: tuple[MovingRegion | None, ...]  # by view

    @property
    def rank(self) -> tuple[int, float]:
        """How well it is seen: in how many views whole, and how large in all of them [px]."""
        seen = [region for region in self.regions if region is not None]
        return sum(not region.is_cut for region in seen), sum(region.area_px for region in seen)


def find_places(moment: Moment, radius_m: float) -> list[Place]:
    """Find where something as large as a body of this radius may be, in most views and largest first."""
    regions = moving_regions(moment)
    seen = [view for view, own in enumerate(regions) if own]
    rig = Rig(tuple(regions[view][0].camera for view in seen))
    centres = [np.array([region.centre for region in regions[view]]) for view in seen]
    found: list[Place] = []
    for pair in combinations(range(len(seen)), 2):
        for position, chosen in zip(*_match(rig, centres, pair, _APART * radius_m), strict=True):
            of_view = {seen[k]: regions[seen[k]][region] for k, region in enumerate(chosen) if region >= 0}
            found.append(Place(position, tuple(of_view.get(view) for view in range(len(regions)))))
    found.sort(key=lambda place: place.rank, reverse=True)
    apart: list[Place] = []
    for place in found:
        if all(np.linalg.norm(place.position - other.position) > 0.5 * radius_m for other in apart):
            apart.append(place)
    return apart


def _match(rig: Rig, centres: Sequence[Array], pair: tuple[int, int], reach_m: float) -> tuple[Array, NDArray[np.intp]]:
    """Triangulate each two regions of two views with the nearest one of every other view, where their rays meet.

    centres (regions, 2) [px] of each camera. Return the points (n, 3) world [m], and which region of each camera
    (n, cameras) belongs to them, -1 where none lies within reach.
    """
    chosen = np.full((len(centres[pair[0]]) * len(centres[pair[1]]), len(rig)), -1)
    chosen[:, pair] = list(product(*(range(len(centres[view])) for view in pair)))
    points = _triangulate(rig, centres, chosen)
    does_meet = np.isfinite(points).all(axis=1)
    for view, (camera, own) in enumerate(zip(rig, centres, strict=True)):
        off_m = _distances_m(camera, own, points)
        if view in pair:
            does_meet &= np.take_along_axis(off_m, chosen[:, view, None], axis=1)[:, 0] <= reach_m
        else:
            chosen[:, view] = np.where(off_m.min(axis=1) < reach_m, off_m.argmin(axis=1), -1)
    refined = _triangulate(rig, centres, chosen)
    is_place = does_meet & np.isfinite(refined).all(axis=1)
    return refined[is_place], chosen[is_place]


def _triangulate(rig: Rig, centres: Sequence[Array], chosen: NDArray[np.intp]) -> Array:
    """Triangulate the chosen regions (n, cameras), -1 for none: (n, 3) [m], NaN where rays do not meet."""
    px = [np.where(of_view[:, None] < 0, np.nan, own[of_view]) for own, of_view in zip(centres, chosen.T, strict=True)]
    return rig.points_from_px(np.stack(px, axis=1))


def _distances_m(camera: Camera, centres: Array, points: Array) -> Array:
    """Return how far points lie beside regions' middles, at the points' depth (points, regions); infinite behind."""
    depth_m = camera.camera_from_world.apply(points)[:, 2]
    off_px = camera.px_from_world(points)[:, None] - centres
    off_m = np.linalg.norm(off_px / np.diag(camera.K)[:2], axis=-1) * depth_m[:, None]
    return np.where(depth_m[:, None] > NEAREST_M, off_m, np.inf)


def moving_regions(moment: Moment) -> list[list[MovingRegion]]:
    """Return the regions of each view that stand out, the largest first; none where nothing is known of it."""
    return [
        [] if view is None or nats is None else connected_regions(view.camera, nats)
        for view, nats in zip(moment.frames.views, moment.evidence, strict=True)
    ]


def connected_regions(camera: Camera, nats: Array32) -> list[MovingRegion]:
    """Return the regions of a view that stand out by their evidence (h, w) [nats], the largest first."""
    is_new = cv2.morphologyEx((nats > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(is_new)
    found = []
    for label in range(1, len(boxes)):
        x, y, width, height, area = boxes[label]
        if area < max(_LEAST_SHARE * nats.size, 8):
            continue
        inside = np.s_[y : y + height, x : x + width]
        mask = labels[inside] == label
        weights = np.where(mask, np.maximum(nats[inside], 0), 0)
        total = float(weights.sum())
        rows, columns = weights.sum(axis=1), weights.sum(axis=0)
        middle = np.array([columns @ np.arange(width), rows @ np.arange(height)]) / max(total, 1e-9)
        low, high = np.array([x, y]), np.array([x + width - 1, y + height - 1])
        is_cut = bool(np.any(low == 0) or np.any(high == np.array(camera.size) - 1))
        found.append(MovingRegion(camera, low + middle, total / PIXEL_EVIDENCE_LIMIT, is_cut, (int(x), int(y)), mask))
    found.sort(key=lambda region: -region.area_px)
    return found[:_MOST_REGIONS]
