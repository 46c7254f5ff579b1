"""Clothing estimated from images: where along each segment the colour changes, and the colours."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Region
from airborne.body import BodyModel, Part, PosedBody
from airborne.body.colours import with_sampled_colours
from airborne.body.outfits import Border, ellipsoid_of, extent_m
from airborne.body.shaping import length_axis
from airborne.errors import BodyError
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array

_N_BINS = 50  # along a segment
_LEAST_SHARE = 0.1  # of a segment's length on either side of a border: less is the neighbour's colour
_LEAST_CONTRAST = 25.0  # sRGB grey levels, RMS of the channels, between the sides of a border
_LEAST_EXPLAINED = 0.4  # of the colour's variance along the segment
_STRONG_CONTRAST = 0.4  # of the segment's brightness: shading of one colour never differs as much from end to end
_CORE_PX = 1  # this near to another segment or the scene, a pixel is mixed
_FEWEST_PX = 60  # of one image, and on either side of a border: fewer say nothing
_LEAST_PIXELS = 0.1  # of a segment's pixels that lie on either side of a border
_SIDED = ("_left", "_right")


def stem_of(segment: str) -> str:
    """Return a segment's name without its side."""
    return segment.removesuffix(_SIDED[0]).removesuffix(_SIDED[1])


@dataclass(slots=True)
class _ColourProfiles:
    """Colours along a segment, one array an image: pixels (bins,), colour (bins, 3), its square (bins,)."""

    images: list[tuple[Array, Array, Array]] = field(default_factory=list)

    def add(self, share: Array, rgb: Array) -> None:
        is_on = (share >= 0) & (share < 1)
        at = (share[is_on] * _N_BINS).astype(int)
        rgb = rgb[is_on]
        if len(at) < _FEWEST_PX:
            return
        n = np.bincount(at, minlength=_N_BINS).astype(float)
        colour = np.stack([np.bincount(at, rgb[:, k], _N_BINS) for k in range(3)], axis=1).astype(float)
        square = np.bincount(at, np.einsum("nk,nk->n", rgb, rgb), _N_BINS).astype(float)
        self.images.append((n, colour, square))

    def border(self) -> tuple[float, float] | None:
        """Find the share where the colour steps, and the share of variance that explains; None where it does not.

        Each image has its own two colours. A step must be strong, or explain more than an even change along the
        segment does, which shading may be.
        """
        if not self.images:
            return None
        cuts = np.arange(round(_LEAST_SHARE * _N_BINS), _N_BINS - round(_LEAST_SHARE * _N_BINS) + 1)
        whole, ramp, split, contrast, bright = 0.0, 0.0, np.zeros(len(cuts)), np.zeros(len(cuts)), 0.0
        pixels, below = 0.0, np.zeros(len(cuts))
        u = (np.arange(_N_BINS) + 0.5) / _N_BINS
        for n, colour, square in self.images:
            total = n.sum()
            mean, away = colour.sum(axis=0) / total, u - (n @ u) / total
            own = square.sum() - total * mean @ mean
            whole += own
            slope = away @ colour
            ramp += own - slope @ slope / max(n @ away**2, 1e-9)
            low_n, low = np.cumsum(n)[cuts - 1], np.cumsum(colour, axis=0)[cuts - 1]
            high_n, high = total - low_n, colour.sum(axis=0) - low
            both = np.minimum(low_n, high_n) > 0
            means = low / np.maximum(low_n, 1)[:, None], high / np.maximum(high_n, 1)[:, None]
            gap2 = np.sum((means[1] - means[0]) ** 2, axis=1) * both
            gain = low_n * high_n / total * gap2
            split += own - gain
            contrast += gap2 / 3 * total
            bright += mean @ mean / 3 * total
            pixels += total
            below += low_n
        on_fewer_side = np.minimum(below, pixels - below)
        split[on_fewer_side < max(_FEWEST_PX, _LEAST_PIXELS * pixels)] = np.inf
        best = int(np.argmin(split))
        if not np.isfinite(split[best]):
            return None
        explained = 1 - split[best] / max(whole, 1e-9)
        is_step = split[best] < ramp and explained > _LEAST_EXPLAINED
        if not (is_step or contrast[best] > bright * _STRONG_CONTRAST**2):
            return None
        if contrast[best] < pixels * _LEAST_CONTRAST**2:
            return None
        return float(cuts[best] / _N_BINS), float(explained)


PosedView = tuple[RenderModel, PosedBody, Region]  # the body in one image


def sample_clothing(model: BodyModel, views: Sequence[PosedView]) -> BodyModel:
    """Sample the colours of a body's parts, left and right alike; BodyError for a part that too few pixels show.

    The bodies of the views may differ from the model in their surface.
    """
    uncoloured = replace(
        model,
        segments=tuple(replace(s, parts=tuple(replace(p, colour=None) for p in s.parts)) for s in model.segments),
    )
    render_model = RenderModel.of(uncoloured)
    pixels: dict[str, list[NDArray[np.uint8]]] = defaultdict(list)
    keys = [_key(part) for part in model.parts]
    if not views:
        raise BodyError("the body lies in no camera's image; give frames that show it")
    for _, posed, region in views:
        part_map = render_model.draw_parts(PosedBody(uncoloured, posed.R, posed.t), region)
        interior = _interior(part_map)
        for index, key in enumerate(keys):
            pixels[key].append(region.rgb[interior & (part_map == index)])
    return with_sampled_colours(uncoloured, [np.concatenate(pixels[key]) for key in keys])


def _key(part: Part) -> str:
    """Return a part's name without its side, wherever that stands."""
    return part.name.replace(_SIDED[0], "").replace(_SIDED[1], "")


def find_borders(model: BodyModel, views: Sequence[PosedView]) -> dict[str, Border | None]:
    """Find where the colours of a body's segments change, left and right alike: stem -> Border, or None."""
    profiles: dict[tuple[str, int], _ColourProfiles] = defaultdict(_ColourProfiles)
    axes = {s.name: _border_axes(model, s.name) for s in model.segments if s.parts}
    for render_model, posed, region in views:
        part_map = render_model.draw_parts(posed, region)
        segment = np.where(part_map >= 0, render_model.segment_of_part[part_map], -1)
        interior = _interior(segment)
        for index, name in enumerate(s.name for s in model.segments):
            rows, columns = np.nonzero(interior & (segment == index))
            if not len(rows) or name not in axes:
                continue
            local = _surface_points(model, index, np.stack([columns, rows], axis=1), posed=posed, region=region)
            for axis in axes[name]:
                start, end = extent_m(model, name, axis)
                profiles[stem_of(name), axis].add(
                    (local[:, axis] - start) / (end - start), region.rgb[rows, columns].astype(float)
                )
    borders: dict[str, Border | None] = {stem_of(name): None for name in axes}
    best = dict.fromkeys(borders, 0.0)
    for (stem, axis), colours in profiles.items():
        border = colours.border()
        if border is not None and border[1] > best[stem]:
            borders[stem], best[stem] = Border(border[0], axis), border[1]
    return borders


def _border_axes(model: BodyModel, segment: str) -> list[int]:
    """Return the axes that a segment's border may cross: its length; of a segment without children, its depth too."""
    is_end = all(child.parent != segment for child in model.segments)
    along = length_axis(model, segment)
    return sorted({along, 1}) if is_end and not segment.endswith(_SIDED) else [along]


def _interior(labels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Mark the pixels whose neighbourhood has one label."""
    size = np.ones((2 * _CORE_PX + 1,) * 2, np.uint8)
    shifted = (labels + 1).astype(np.uint16)
    return (cv2.erode(shifted, size) == cv2.dilate(shifted, size)) & (labels >= 0)


def _surface_points(
    model: BodyModel, index: int, px: NDArray[np.integer], *, posed: PosedBody, region: Region
) -> Array:
    """Intersect the rays of pixels (n, 2) with a segment's ellipsoid, in the segment's frame: (n, 3) [m].

    For a ray that just misses it, the nearest point of the ellipsoid's outline.
    """
    ellipsoid, centre = ellipsoid_of(model, model.segments[index].name)
    camera, R = region.camera, posed.R[index]
    rays = np.concatenate([px, np.ones((len(px), 1))], axis=1) @ np.linalg.inv(camera.K).T
    world_from_camera = camera.camera_from_world.inv()
    axes = ellipsoid.semi_axes_m
    d = world_from_camera.rotation.apply(rays) @ R / axes
    o = ((world_from_camera.translation - posed.t[index]) @ R - centre) / axes
    a, b, c = np.einsum("nk,nk->n", d, d), d @ o, o @ o - 1
    depth = (-b - np.sqrt(np.maximum(b**2 - a * c, 0))) / a
    return (o + depth[:, None] * d) * axes + centre
