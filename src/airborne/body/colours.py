"""Colours taken from the video: `colour = "sample"`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.body.model import BodyModel
from airborne.errors import BodyError

FEWEST_PX = 20  # fewer pixels than this say nothing of a part's colour


def with_sampled_colours(model: BodyModel, pixels_of_parts: list[NDArray[np.uint8]]) -> BodyModel:
    """Give every uncoloured part the median of the pixels that show it.

    pixels_of_parts: one (n, 3) array of sRGB per part, in the order of `model.parts`. Raises BodyError for a
    part that too few pixels show.
    """
    colours = []
    for part, pixels in zip(model.parts, pixels_of_parts, strict=True):
        if part.colour is None and len(pixels) < FEWEST_PX:
            raise BodyError(
                f"part '{part.name}' asks for colour = \"sample\", but only {len(pixels)} pixels show it at the first "
                f"pose (at least {FEWEST_PX} needed); correct the start pose or give colour_srgb"
            )
        colours.append(np.median(pixels, axis=0) if part.colour is None else part.colour)
    return model.with_colours(np.array(colours))
