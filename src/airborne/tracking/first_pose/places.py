"""Where something moves: regions that stand out in each view, matched over the cameras by their rays."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.empty_scene import PIXEL_EVIDENCE_LIMIT
from airborne.cameras import Camera, Rig
from airborne.tracking.first_pose.moments import Moment
from airborne.types import Array

_LEAST_SHARE = 1e-4  # of the picture that a region covers
_MOST_REGIONS = 6  # of a view, the largest
_APART = 0.7  # body radii by which rays of one body's regions may miss each other


@dataclass(frozen=True, slots=True, eq=False)
class MovingRegion:
    """A connected region that stands out in one view."""

    camera: Camera
    centre: Array  # (2,) [px], by evidence
    area_px: float  # of what stands out in it [px]
    is_cut: bool  # by the picture's border


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
    regions = [
        [] if view is None or nats is None else _regions(view.camera, nats)
        for view, nats in zip(moment.frames.views, moment.evidence, strict=True)
    ]
    found: list[Place] = []
    for a, b in combinations(range(len(regions)), 2):
        for first in regions[a]:
            for second in regions[b]:
                place = _match(regions, {a: first, b: second}, radius_m)
                if place is not None:
                    found.append(place)
    found.sort(key=lambda place: place.rank, reverse=True)
    apart: list[Place] = []
    for place in found:
        if all(np.linalg.norm(place.position - other.position) > 0.5 * radius_m for other in apart):
            apart.append(place)
    return apart


def _match(regions: list[list[MovingRegion]], pair: dict[int, MovingRegion], radius_m: float) -> Place | None:
    """Triangulate two regions and take the nearest one of every other view; None where their rays do not meet."""
    chosen = dict(pair)
    position = _triangulate(chosen)
    if position is None or any(_distance_m(region, position) > _APART * radius_m for region in pair.values()):
        return None
    for view, others in enumerate(regions):
        if view not in pair and others:
            nearest = min(others, key=lambda region: _distance_m(region, position))
            if _distance_m(nearest, position) < _APART * radius_m:
                chosen[view] = nearest
    refined = _triangulate(chosen)
    if refined is None:
        return None
    return Place(refined, tuple(chosen.get(view) for view in range(len(regions))))


def _triangulate(chosen: dict[int, MovingRegion]) -> Array | None:
    rig = Rig(tuple(region.camera for region in chosen.values()))
    position = rig.points_from_px(np.stack([region.centre for region in chosen.values()]))
    return position if np.isfinite(position).all() else None


def _distance_m(region: MovingRegion, position: Array) -> float:
    """Return how far a point lies beside a region's middle, at the point's depth; infinite behind the camera."""
    depth_m = float(region.camera.camera_from_world.apply(position)[2])
    if depth_m <= 0.1:
        return np.inf
    focal = np.array([region.camera.K[0, 0], region.camera.K[1, 1]])
    return float(np.linalg.norm((region.camera.px_from_world(position) - region.centre) / focal) * depth_m)


def _regions(camera: Camera, nats: NDArray[np.float32]) -> list[MovingRegion]:
    is_new = cv2.morphologyEx((nats > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(is_new)
    found = []
    for label in range(1, len(boxes)):
        x, y, width, height, area = boxes[label]
        if area < max(_LEAST_SHARE * nats.size, 8):
            continue
        inside = np.s_[y : y + height, x : x + width]
        weights = np.where(labels[inside] == label, np.maximum(nats[inside], 0), 0)
        total = float(weights.sum())
        rows, columns = weights.sum(axis=1), weights.sum(axis=0)
        middle = np.array([columns @ np.arange(width), rows @ np.arange(height)]) / max(total, 1e-9)
        low, high = np.array([x, y]), np.array([x + width - 1, y + height - 1])
        is_cut = bool(np.any(low == 0) or np.any(high == np.array(camera.size) - 1))
        found.append(MovingRegion(camera, low + middle, total / PIXEL_EVIDENCE_LIMIT, is_cut))
    found.sort(key=lambda region: -region.area_px)
    return found[:_MOST_REGIONS]
