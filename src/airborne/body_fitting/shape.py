"""A body's shape as a vector, left and right alike: logarithms of factors on lengths and girths, shifts of borders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from airborne.body import BodyModel
from airborne.body.inverse_kinematics import CORE
from airborne.body.outfits import Border, extent_m, with_borders
from airborne.body.shaping import half_size_m, length_axis, with_girths, with_joint_widths, with_segment_lengths
from airborne.body_fitting.clothes import stem_of
from airborne.types import Array

_LENGTH_SD, _END_LENGTH_SD, _GIRTH_SD = 0.03, 0.08, 0.12  # of a factor; END: of a segment without children
_WIDTH_SD = 0.05  # of a factor on the distance of the hips: wider, the thighs' outlines draw it apart
_BORDER_SD = 0.05  # of a border's share, about the detected one
_INSIDE = 0.02, 0.98  # shares of a segment within which a border stays


@dataclass(frozen=True, slots=True)
class ShapeParameter:
    """One parameter of a shape."""

    stem: str  # the segment without its side
    kind: Literal["length", "width", "girth", "border"]
    size_m: float  # what it scales
    sd: float  # of a border: of its share; else of the logarithm
    axis: int | None = None  # of a girth: the first or the second axis across; None: both
    border: Border | None = None  # of a border: where it is at 0


def shape_parameters(model: BodyModel) -> tuple[ShapeParameter, ...]:
    """List the parameters: every segment's length and girth; of one without a side, two girths; the hips' width."""
    parameters: list[ShapeParameter] = []
    for segment in model.segments:
        stem = stem_of(segment.name)
        if not segment.parts or stem in {parameter.stem for parameter in parameters}:
            continue
        half = np.max([half_size_m(part) for part in segment.parts], axis=0)
        along = length_axis(model, segment.name)
        is_end = all(child.parent != segment.name for child in model.segments)
        across = [axis for axis in range(3) if axis != along]
        parameters.append(
            ShapeParameter(stem, "length", 2 * float(half[along]), _END_LENGTH_SD if is_end else _LENGTH_SD)
        )
        if stem == segment.name:
            parameters += [
                ShapeParameter(stem, "girth", float(half[axis]), _GIRTH_SD, axis=i) for i, axis in enumerate(across)
            ]
        else:
            parameters.append(ShapeParameter(stem, "girth", float(half[across].mean()), _GIRTH_SD))
        width_m = joint_width_m(model, segment.name)
        if width_m:
            parameters.append(ShapeParameter(stem, "width", width_m, _WIDTH_SD))
    return tuple(parameters)


def joint_width_m(model: BodyModel, name: str) -> float:
    """Return how far apart the hips' or shoulders' joints are that a segment carries on either side [m]; else 0."""
    owners = [mark.segment for mark in model.landmarks if mark.name in CORE and mark.at_joint]
    x_m = [segment.joint_m[0] for segment in model.segments if segment.parent == name and segment.name in owners]
    return float(np.ptp(x_m)) if len(x_m) > 1 else 0.0


def segments_of(model: BodyModel, stem: str) -> list[str]:
    """Return the segments of a name without its side."""
    return [segment.name for segment in model.segments if stem_of(segment.name) == stem]


def apply_shape(base: BodyModel, parameters: Sequence[ShapeParameter], shape: Array) -> BodyModel:
    """Return the body of a shape (k,), which is 0 for `base`."""
    bordered = (
        with_borders(base, borders_of(parameters, shape)) if any(parameter.border for parameter in parameters) else base
    )
    longer = with_segment_lengths(bordered, lengths_of(parameters, shape))
    return with_girths(with_joint_widths(longer, widths_of(parameters, shape)), girths_of(parameters, shape))


def border_parameters(model: BodyModel, borders: Mapping[str, Border | None]) -> tuple[ShapeParameter, ...]:
    """List the parameters of the borders."""
    names = {stem_of(segment.name): segment.name for segment in model.segments}
    return tuple(
        ShapeParameter(
            stem, "border", abs(float(np.diff(extent_m(model, names[stem], border.axis))[0])), _BORDER_SD, border=border
        )
        for stem, border in borders.items()
        if border is not None
    )


def borders_of(parameters: Sequence[ShapeParameter], shape: Array) -> dict[str, Border]:
    """Return a shape's borders by stem."""
    return {
        parameter.stem: replace(parameter.border, share=float(np.clip(parameter.border.share + value, *_INSIDE)))
        for parameter, value in zip(parameters, shape, strict=True)
        if parameter.border is not None
    }


def lengths_of(
    parameters: Sequence[ShapeParameter], shape: Array, first: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Return a shape's factors of length by stem, multiplied by those of `first`, by segment, where given."""
    by_stem = {stem_of(name): scale for name, scale in (first or {}).items()}
    return {
        parameter.stem: by_stem.get(parameter.stem, 1.0) * float(np.exp(value))
        for parameter, value in zip(parameters, shape, strict=True)
        if parameter.kind == "length"
    }


def widths_of(parameters: Sequence[ShapeParameter], shape: Array) -> dict[str, float]:
    """Return a shape's factors of the distance of a segment's joints, left to right, by stem."""
    return {
        parameter.stem: float(np.exp(value))
        for parameter, value in zip(parameters, shape, strict=True)
        if parameter.kind == "width"
    }


def girths_of(parameters: Sequence[ShapeParameter], shape: Array) -> dict[str, tuple[float, float]]:
    """Return a shape's factors of girth, two axes across, by stem."""
    factors: dict[str, list[float]] = {}
    for parameter, value in zip(parameters, shape, strict=True):
        if parameter.kind == "girth":
            own = factors.setdefault(parameter.stem, [1.0, 1.0])
            for axis in (0, 1) if parameter.axis is None else (parameter.axis,):
                own[axis] = float(np.exp(value))
    return {stem: (across[0], across[1]) for stem, across in factors.items()}
