"""The body of whom stature and mass are known alone, after the first frames: its own girths, lengths and clothes."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.body import BodyModel, Pose
from airborne.body_fitting.found_poses import fit_found
from airborne.errors import BodyError
from airborne.video import Frames

N_FRAMES, EVERY = 9, 2  # frames tracked for it, and which of them are fitted: chosen on five synthetic people


def fit_preset(model: BodyModel, found: Sequence[tuple[Frames, Pose]], *, mass_kg: float | None) -> BodyModel | None:
    """Fit a body's shape and clothes to frames in which its pose was found; None where they do not show all of it."""
    try:
        return fit_found(model, found, mass_kg=mass_kg).model
    except BodyError:
        return None
