"""A body's shape as a vector: the logarithms of factors on its segments' lengths and girths, left and right alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Box, Ellipsoid, Part
from airborne.body.shaping import length_axis, with_girths, with_segment_lengths
from airborne.tracking.clothes import stem_of

Array = NDArray[np.floating]

LENGTH_SD, END_LENGTH_SD, GIRTH_SD = 0.03, 0.08, 0.12  # of a factor; END: of a segment in which no joint hangs


@dataclass(frozen=True, slots=True)
class Knob:
    """One number of a shape."""

    stem: str  # the segment without its side
    is_length: bool
    axis: int | None  # of a girth: the first or the second axis across; None: both
    size_m: float  # what it scales
    sd: float  # of its logarithm


def knobs_of(model: BodyModel) -> tuple[Knob, ...]:
    """List what may change: of every segment its length and girth; of one without a side, both girths apart."""
    found: list[Knob] = []
    for segment in model.segments:
        stem = stem_of(segment.name)
        if not segment.parts or stem in {knob.stem for knob in found}:
            continue
        half = np.max([_half_m(part) for part in segment.parts], axis=0)
        along = length_axis(model, segment.name)
        is_end = all(child.parent != segment.name for child in model.segments)
        across = [axis for axis in range(3) if axis != along]
        found.append(Knob(stem, True, None, 2 * float(half[along]), END_LENGTH_SD if is_end else LENGTH_SD))
        if stem == segment.name:
            found += [Knob(stem, False, i, float(half[axis]), GIRTH_SD) for i, axis in enumerate(across)]
        else:
            found.append(Knob(stem, False, None, float(half[across].mean()), GIRTH_SD))
    return tuple(found)


def shaped(base: BodyModel, knobs: Sequence[Knob], shape: Array) -> BodyModel:
    """Return the body of a shape (k,), which is 0 for `base`."""
    return with_girths(with_segment_lengths(base, lengths_of(knobs, shape)), girths_of(knobs, shape))


def lengths_of(knobs: Sequence[Knob], shape: Array, first: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return a shape's factors of length by stem, multiplied by those of `first`, by segment, where given."""
    by_stem = {stem_of(name): scale for name, scale in (first or {}).items()}
    return {
        knob.stem: by_stem.get(knob.stem, 1.0) * float(np.exp(value))
        for knob, value in zip(knobs, shape, strict=True)
        if knob.is_length
    }


def girths_of(knobs: Sequence[Knob], shape: Array) -> dict[str, tuple[float, float]]:
    """Return a shape's factors across, by stem."""
    found: dict[str, list[float]] = {}
    for knob, value in zip(knobs, shape, strict=True):
        if not knob.is_length:
            own = found.setdefault(knob.stem, [1.0, 1.0])
            for axis in (0, 1) if knob.axis is None else (knob.axis,):
                own[axis] = float(np.exp(value))
    return {stem: (across[0], across[1]) for stem, across in found.items()}


def _half_m(part: Part) -> Array:
    """Return half the size of a part along its segment's axes: (3,) [m]."""
    shape = part.shape
    if isinstance(shape, Ellipsoid):
        half = shape.semi_axes_m
    else:
        half = shape.size_m / 2 if isinstance(shape, Box) else np.ptp(shape.vertices_m, axis=0) / 2
    return np.abs(part.segment_from_part.rotation.as_matrix()) @ half
