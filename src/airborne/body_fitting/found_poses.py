"""A body fitted to frames in which its pose was found."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.body import BodyModel, Pose
from airborne.body_fitting.fit import BodyFit, BodyObservation, fit_body
from airborne.video import Frames

_LEVELS_PX_PER_M = (150.0,)  # the poses are found already: no coarser images are needed
_LANDMARK_WEIGHT = 0.25  # 5 cm: the landmarks come from the same images, perhaps with a body of other lengths


def fit_found(
    model: BodyModel,
    found: Sequence[tuple[Frames, Pose]],
    *,
    mass_kg: float | None = None,
    girths_alone: bool = False,
) -> BodyFit:
    """Fit a body to frames and the pose found in each; see `fit_body`, which raises BodyError."""
    names = [mark.name for mark in model.landmarks]
    observations = [
        BodyObservation(frames, dict(zip(names, model.with_pose(pose).landmarks, strict=True)), pose)
        for frames, pose in found
    ]
    return fit_body(
        model,
        observations,
        weights=dict.fromkeys(names, _LANDMARK_WEIGHT),
        mass_kg=mass_kg,
        levels_px_per_m=_LEVELS_PX_PER_M,
        girths_alone=girths_alone,
    )
