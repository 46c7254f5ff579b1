"""The skin of a person whose poses are known: its girths fitted to the images."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.body import BodyModel, Pose
from airborne.body.skin import stretch_skin
from airborne.body_fitting.fit import BodyObservation, fit_body
from airborne.errors import BodyError
from airborne.video import Frames

N_FRAMES = 6  # that are fitted, spread over the run
_LEVELS_PX_PER_M = (150.0,)  # the poses are found already: no coarser images are needed
_LANDMARK_WEIGHT = 0.25  # 5 cm: the landmarks come from the same images
# share of the skin's residual: ellipsoids that were drawn leave 0.91 of it, synthetic people with a skin 0.98 to 1.07
_CLEARLY_LESS = 0.95


def fit_skin(model: BodyModel, found: Sequence[tuple[Frames, Pose]]) -> BodyModel | None:
    """Return a person's body in a smooth skin as thick as frames show, in which its pose was found.

    Joints and landmarks stay. None for a body that has no such skin, of which the frames do not show every part, or
    that looks clearly more like its ellipsoids, their girths fitted likewise.
    """
    skin, names = stretch_skin(model), [mark.name for mark in model.landmarks]
    if skin is None or not found:
        return None
    observations = [
        BodyObservation(frames, dict(zip(names, model.with_pose(pose).landmarks, strict=True)))
        for frames, pose in found
    ]
    try:
        fits = [
            fit_body(
                surface,
                observations,
                weights=dict.fromkeys(names, _LANDMARK_WEIGHT),
                levels_px_per_m=_LEVELS_PX_PER_M,
                girths_alone=True,
            )
            for surface in (model, skin)
        ]
    except BodyError:
        return None
    of_ellipsoids, of_skin = (fit.rms_light[1] for fit in fits)
    return None if of_ellipsoids < _CLEARLY_LESS * of_skin else fits[1].model
