"""Moments of a recording as finding looks at them: small pictures, and what stands out from the empty scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from airborne.appearance.empty_scene import FEWEST_PICTURES, EmptyScene, estimate_empty_scene
from airborne.appearance.model import Region
from airborne.body import PosedBody, SurfaceArrays
from airborne.tracking.image_regions import crop_regions
from airborne.types import Array32
from airborne.video import Frames, View
from airborne.video.small import shrink

_MOST_MOMENTS = 24  # enough for a median, and to meet a body that is seen for a tenth of the time

SourceKey = tuple[str, bytes]  # camera name and intrinsics: pictures that share them show the scene by the same pixels


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What stands out in every view at one time."""

    frames: Frames  # small pictures
    evidence: tuple[Array32 | None, ...]  # (h, w) by view [nats]; None: no picture, or no empty scene

    @property
    def probability(self) -> tuple[Array32 | None, ...]:
        """Each pixel's probability (h, w) to show what is not in the empty scene, at even odds."""
        return tuple(None if nats is None else np.asarray(expit(nats), np.float32) for nats in self.evidence)


def crop_probability(
    moment: Moment, bodies: Sequence[PosedBody], geometry: SurfaceArrays, margin_px: int
) -> tuple[list[Region], list[Array32]]:
    """Cut out what holds the posed bodies in every view; return the regions and the probabilities in them."""
    seen = {
        source_of(view): plane
        for view, plane in zip(moment.frames.views, moment.probability, strict=True)
        if view is not None and plane is not None
    }
    regions = crop_regions(bodies, geometry, moment.frames, margin_px)
    regions = [region for region in regions if region.source in seen]
    return regions, [np.ascontiguousarray(region.crop(seen[region.source])) for region in regions]


def spread_sample(recording: Iterable[Frames], n_expected: int | None) -> list[Frames]:
    """Keep 12 to 24 times, spread evenly over a recording of about so many, or any number, as small pictures."""
    stride, kept = max(1, -(-(n_expected or 0) // _MOST_MOMENTS)), []
    for number, frames in enumerate(recording):
        if number % stride:
            continue
        views = tuple(None if view is None else shrink(view) for view in frames.views)
        kept.append(Frames(frames.index, frames.time_s, views))
        if len(kept) > _MOST_MOMENTS:
            stride, kept = 2 * stride, kept[::2]
    return kept


def empty_scenes(sample: Sequence[Frames]) -> dict[SourceKey, EmptyScene]:
    """Find the empty scene of every camera, and kind of field, that has enough pictures."""
    pictures: dict[SourceKey, list] = {}
    for frames in sample:
        for view in frames.views:
            if view is not None:
                pictures.setdefault(source_of(view), []).append(view.rgb)
    return {source: estimate_empty_scene(each) for source, each in pictures.items() if len(each) >= FEWEST_PICTURES}


def look(sample: Sequence[Frames], scenes: Mapping[SourceKey, EmptyScene]) -> list[Moment]:
    """Compare every picture with the empty scene."""
    return [Moment(frames, tuple(_evidence(view, scenes) for view in frames.views)) for frames in sample]


def _evidence(view: View | None, scenes: Mapping[SourceKey, EmptyScene]) -> Array32 | None:
    scene = None if view is None else scenes.get(source_of(view))
    return None if view is None or scene is None else scene.evidence(view.rgb)


def source_of(view: View) -> SourceKey:
    """Return what a view shows the static scene by."""
    return view.camera.name, view.camera.K.tobytes()
