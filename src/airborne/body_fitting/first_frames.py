"""The body of whom stature and mass are known alone, after the first frames: its own girths, lengths and clothes."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.body import BodyModel, Pose
from airborne.body_fitting.fit import BodyObservation, fit_body
from airborne.errors import BodyError
from airborne.video import Frames

N_FRAMES, EVERY = 9, 2  # frames tracked for it, and which of them are fitted: chosen on five synthetic people
_LEVELS_PX_PER_M = (150.0,)  # the poses are found already: no coarser images are needed
_LANDMARK_WEIGHT = 0.25  # 5 cm: the landmarks come from the same images, with a body of other lengths


def fit_preset(model: BodyModel, found: Sequence[tuple[Frames, Pose]], *, mass_kg: float | None) -> BodyModel | None:
    """Fit a body's shape and clothes to frames in which its pose was found; None where they do not show all of it."""
    names = [mark.name for mark in model.landmarks]
    try:
        fit = fit_body(
            model,
            [
                BodyObservation(frames, dict(zip(names, model.with_pose(pose).landmarks, strict=True)))
                for frames, pose in found
            ],
            weights=dict.fromkeys(names, _LANDMARK_WEIGHT),
            mass_kg=mass_kg,
            levels_px_per_m=_LEVELS_PX_PER_M,
        )
    except BodyError:
        return None
    return fit.model
