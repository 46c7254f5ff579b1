"""The body of whom stature and mass are known alone, after the first frame: its own girths, lengths and clothes."""

from __future__ import annotations

from airborne.body import BodyModel, Pose
from airborne.body_fitting.fit import BodyObservation, fit_body
from airborne.errors import BodyError
from airborne.video import Frames

_LEVELS_PX_PER_M = (150.0,)  # the pose is found already: no coarser images are needed
_LANDMARK_WEIGHT = 0.25  # 5 cm: the landmarks come from the same images, with a body of other lengths


def fit_preset(model: BodyModel, pose: Pose, frames: Frames, *, mass_kg: float | None) -> tuple[BodyModel, Pose] | None:
    """Fit a body's shape and clothes to frames in which its pose was found; None where they do not show all of it."""
    landmarks = {mark.name: at for mark, at in zip(model.landmarks, model.with_pose(pose).landmarks, strict=True)}
    try:
        fit = fit_body(
            model,
            [BodyObservation(frames, landmarks)],
            weights=dict.fromkeys(landmarks, _LANDMARK_WEIGHT),
            mass_kg=mass_kg,
            levels_px_per_m=_LEVELS_PX_PER_M,
        )
    except BodyError:
        return None
    return fit.model, fit.poses[0]
