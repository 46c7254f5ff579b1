"""Colours taken from the video: `colour = "sample"`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.body.model import BodyModel
from airborne.body.sides import other_side
from airborne.errors import BodyError
from airborne.types import Array

FEWEST_PX = 20  # fewer pixels than this say nothing of a part's colour


def with_sampled_colours(
    model: BodyModel, pixels_of_parts: list[NDArray[np.uint8]], note: Callable[[str], None] = lambda line: None
) -> BodyModel:
    """Give every uncoloured part the median of the pixels that show it.

    pixels_of_parts: one (n, 3) array of sRGB per part, in the order of `model.parts`. A part that too few pixels show
    takes the colour of its other side, or else of the nearest segment toward the root; `note` is told. Raises BodyError
    where these have none either.
    """
    seen: list[Array | None] = []
    for part, pixels in zip(model.parts, pixels_of_parts, strict=True):
        sampled = np.median(pixels, axis=0) if len(pixels) >= FEWEST_PX else None
        seen.append(sampled if part.colour is None else part.colour)
    colours = list(seen)
    for index in (k for k, colour in enumerate(seen) if colour is None):
        name, n = model.parts[index].name, len(pixels_of_parts[index])
        where = f"only {n} pixels show it at the first pose (at least {FEWEST_PX} needed)"
        donor = next((each for each in _kin(model, index) if seen[each] is not None), None)
        if donor is None:
            raise BodyError(
                f"part '{name}' asks for colour = \"sample\", but {where}; correct the start pose or give colour_srgb"
            )
        note(f"body: part '{name}' has the colour of '{model.parts[donor].name}', as {where}")
        colours[index] = seen[donor]
    return model.with_colours(np.array(colours))


def _kin(model: BodyModel, index: int) -> Iterator[int]:
    """Yield the parts whose colour a part most likely has: that of its other side, then those toward the root."""
    names = [part.name for part in model.parts]
    other = other_side(names[index])
    if other != names[index] and other in names:
        yield names.index(other)
    segments: Sequence[int] = [k for k, segment in enumerate(model.segments) for _ in segment.parts]
    segment = segments[index]
    while model.parents[segment] >= 0:
        segment = model.parents[segment]
        yield from (k for k, each in enumerate(segments) if each == segment)
