"""The colours of a body beside those that the images show where it was tracked."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice

import numpy as np

from airborne.body import BodyModel, Pose, surface_arrays
from airborne.motion import Motion
from airborne.rendering import FLAT, render
from airborne.tracking import Status
from airborne.types import Array
from airborne.video import Frames

_N_FRAMES = 4  # chosen: of those that a run keeps
_FEWEST_PX = 20  # chosen: of a part, that say its colour
# RMS of sRGB values over the body, chosen: of four synthetic people in a hall, darker than their files say, 15 to 21;
# with their colours in another order or inverted 67 to 99; of four synthetic throws 8 to 14, of a blue or green file 92
# to 144
_MOST_OFF = 35.0
# least and most of a part's own brightness over the body's, chosen: of a matt thing one side faces a window, the other
# the floor, and a glossy one mirrors a lamp
_DARKEST, _BRIGHTEST = 0.5, 2.0
_N_NAMED = 3  # parts, chosen
_OF_PERSON = "is it another person's file, or in other clothes", "Fit it anew (airborne fit-body)"
_OF_THING = "is it another thing's file, or are red and blue exchanged in the videos", "Correct the file"


def find_wrong_colours(model: BodyModel, motion: Motion, kept: Iterable[Frames]) -> list[str]:
    """Return, as a sentence, that a body has other colours than images show at tracked poses, up to a light."""
    rows = {int(index): row for row, index in enumerate(motion.index) if motion.status[row] == Status.TRACKED.value}
    shown = islice(((frames, motion.pose(rows[frames.index])) for frames in kept if frames.index in rows), _N_FRAMES)
    if model.needs_colours:
        return []
    seen, weights = _seen_colours(model, shown)
    if not weights.any():
        return []
    off, total = _differences(np.array([part.colour for part in model.parts]), seen, weights)
    if total <= _MOST_OFF:
        return []
    worst = [model.parts[i].name for i in np.argsort(off * np.sqrt(weights))[::-1][:_N_NAMED]]
    cause, mend = _OF_PERSON if model.has_joints else _OF_THING
    return [
        f"the body's colours lie {total:.0f} sRGB values (RMS) from those that the images show at its tracked poses, "
        f"most of all those of {', '.join(worst)}; expected {_MOST_OFF:.0f} at most: {cause}? "
        f'{mend}, or write colour = "sample" for its parts'
    ]


def _seen_colours(model: BodyModel, shown: Iterable[tuple[Frames, Pose]]) -> tuple[Array, Array]:
    """Return the median colour (parts, 3) of each part's pixels, sRGB, and their number (parts,), 0 of too few."""
    flat, pixels = surface_arrays(model), [[np.zeros((0, 3), np.uint8)] for _ in model.parts]
    for frames, pose in shown:
        posed = model.with_pose(pose)
        for view in filter(None, frames.views):
            part = render(flat, posed, view.camera, FLAT).part
            for index, own in enumerate(pixels):
                own.append(view.rgb[part == index])
    joined = [np.concatenate(own) for own in pixels]
    weights = np.array([len(own) if len(own) >= _FEWEST_PX else 0 for own in joined], float)
    return np.array([np.median(own, axis=0) if len(own) else np.zeros(3) for own in joined]), weights


def _differences(own: Array, seen: Array, weights: Array) -> tuple[Array, float]:
    """Return how far colours (parts, 3) lie from those seen, however brightly each is lit: (parts,), and in all."""
    whole = np.sum(weights[:, None] * own * seen) / max(np.sum(weights[:, None] * own**2), 1.0)
    lit = np.sum(own * seen, axis=1) / np.maximum(np.sum(own**2, axis=1), 1.0)
    lit = np.clip(lit, _DARKEST * whole, _BRIGHTEST * whole)
    off = np.sqrt(np.mean((seen - lit[:, None] * own) ** 2, axis=1))
    return off, float(np.sqrt(np.sum(weights * off**2) / weights.sum()))
