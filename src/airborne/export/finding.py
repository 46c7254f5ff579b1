"""empty_scene.png and candidates.png: what stands out from the empty scene, and where the body was found in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.appearance.empty_scene import EmptyScene
from airborne.body import PosedBody
from airborne.cameras import Camera
from airborne.export.mosaic import ColumnTitle, write_mosaic
from airborne.export.palette import ESTIMATE_RGB, SIDE_RGB
from airborne.export.views import cached_surface_arrays
from airborne.rendering import FLAT, render
from airborne.tracking.capsules.surface_colours import class_image
from airborne.tracking.first_pose.moments import Moment, SourceKey, source_of
from airborne.types import Array, Image
from airborne.video import Frames, View

_TITLES = ("empty scene", "what stands out", "where the body was found")
_ASPECT = 0.8  # height over width of a cell: whole images are wider than high
_MOST_ASPECT = 1.6  # chosen: of a cell that shows an upright body
_TINT = 0.5  # share of a side's colour in that of its limbs
_MARGIN = 0.6  # around a candidate, as a share of its size


def draw_empty_scene(path: Path, moment: Moment, scenes: Mapping[SourceKey, EmptyScene], posed: PosedBody) -> None:
    """Draw for every camera the empty scene, what stands out from it at one moment, and the body's outline."""
    rows, names = [], []
    for view, shown in zip(moment.frames.views, moment.probability, strict=True):
        if view is None or shown is None:
            continue
        names.append(view.camera.name)
        empty = scenes[source_of(view)].rgb.astype(np.uint8)
        grey = np.repeat((255 * shown).astype(np.uint8)[..., None], 3, axis=2)
        square = [_square_pixels(image, view.camera) for image in (empty, grey, _with_outline(view, posed))]
        rows.append(square)
    write_mosaic(path, rows, names, [ColumnTitle(text) for text in _TITLES], aspect=_ASPECT)


def draw_candidates(path: Path, moment: Moment, candidates: Sequence[tuple[str, PosedBody]]) -> None:
    """Draw the outlines of candidates, each with its label, one row a candidate, in every view.

    Limbs of the left and of the right, as the segments' names have them, are tinted in two colours: which way a person
    faces shows in no outline.
    """
    views = [view for view in moment.frames.views if view is not None]
    rows = [[_near(_with_sides(view, posed), view.camera, posed) for view in views] for _, posed in candidates]
    _write_candidates(path, rows, [label for label, _ in candidates], views)


def draw_player_candidates(path: Path, frames: Frames, candidates: Sequence[tuple[str, Sequence[Array]]]) -> None:
    """Draw the outlines of candidates' players, states (35,), one row a candidate, in every view."""
    views = [view for view in frames.views if view is not None]
    images = [[_with_players(view, states) for view in views] for _, states in candidates]
    boxes = [_box_of(view.camera, [state for _, states in candidates for state in states]) for view in views]
    rows = [[image[box] for image, box in zip(row, boxes, strict=True)] for row in images]
    _write_candidates(path, rows, [label for label, _ in candidates], views)


def _write_candidates(
    path: Path, rows: Sequence[Sequence[Image | None]], labels: Sequence[str], views: Sequence[View]
) -> None:
    """Write rows of images around candidates, a column a view, in cells as high as the images ask for."""
    highest = max((image.shape[0] / image.shape[1] for row in rows for image in row if image is not None), default=0)
    names = [f"{number}: {label}" for number, label in enumerate(labels, start=1)]
    titles = [ColumnTitle(view.camera.name) for view in views]
    write_mosaic(path, rows, names, titles, aspect=min(max(highest, _ASPECT), _MOST_ASPECT))


def _with_players(view: View, states: Sequence[Array]) -> Image:
    image = view.rgb
    for state in states:
        image = _outline(image, class_image(state, view.camera, 1.0) >= 0)
    return image


def _box_of(camera: Camera, states: Sequence[Array]) -> tuple[slice, slice]:
    """Return the rows and columns around players; all of them where the view shows none."""
    mask = np.zeros(camera.size[::-1], bool)
    for state in states:
        mask |= class_image(state, camera, 1.0) >= 0
    return _around(mask) if mask.any() else (slice(None), slice(None))


def _with_outline(view: View, posed: PosedBody) -> Image:
    return _outline(view.rgb, render(cached_surface_arrays(posed.model), posed, view.camera, FLAT).mask)


def _with_sides(view: View, posed: PosedBody) -> Image:
    drawn = render(cached_surface_arrays(posed.model), posed, view.camera, FLAT)
    image = _outline(view.rgb, drawn.mask).astype(float)
    for side, colour in SIDE_RGB.items():
        own = [k for k, segment in enumerate(posed.model.segments) if segment.name.endswith(f"_{side}")]
        shown = np.isin(drawn.segment, own)
        image[shown] += _TINT * (np.array(colour) - image[shown])
    return image.astype(np.uint8)


def _outline(image: Image, mask: NDArray[np.bool_]) -> Image:
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(image.copy(), contours, -1, ESTIMATE_RGB, 1), np.uint8)


def _near(image: Image, camera: Camera, posed: PosedBody) -> Image | None:
    """Cut out what lies around the body; None where the view does not show it."""
    mask = render(cached_surface_arrays(posed.model), posed, camera, FLAT).mask
    return _square_pixels(image[_around(mask)], camera) if mask.any() else None


def _around(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Return the rows and columns of a mask, with a margin."""
    spans = []
    for axis in (1, 0):
        ends, length = np.flatnonzero(mask.any(axis=axis)), mask.shape[1 - axis]
        room = int(_MARGIN * (ends[-1] - ends[0] + 1))
        spans.append(slice(max(ends[0] - room, 0), min(ends[-1] + room + 1, length)))
    return spans[0], spans[1]


def _square_pixels(image: Image, camera: Camera) -> Image:
    """Stretch the rows of a field to square pixels."""
    height = round(image.shape[0] * camera.K[0, 0] / camera.K[1, 1])
    return np.asarray(cv2.resize(image, (image.shape[1], height), interpolation=cv2.INTER_LINEAR), np.uint8)
