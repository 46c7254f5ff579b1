"""The skin of a person whose poses are known: its girths fitted to the images."""

from __future__ import annotations

from collections.abc import Sequence

from airborne.body import BodyModel, Pose
from airborne.body.skin import stretch_skin
from airborne.body_fitting.found_poses import fit_found
from airborne.errors import BodyError
from airborne.video import Frames

N_FRAMES = 6  # that are fitted, spread over the run: with 12, four synthetic somersaults are fitted no better
# share of the skin's residual: ellipsoids that were drawn leave 0.91 of it, synthetic people with a skin 0.98 to 1.07
_CLEARLY_LESS = 0.95


def fit_skin(model: BodyModel, found: Sequence[tuple[Frames, Pose]]) -> BodyModel | None:
    """Return a person's body in a smooth skin as thick as frames show, in which its pose was found.

    Joints and landmarks stay. None for a body that has no such skin, of which the frames do not show every part, or
    that looks clearly more like its ellipsoids, their girths fitted likewise.
    """
    skin = stretch_skin(model)
    if skin is None or not found:
        return None
    try:
        of_ellipsoids, of_skin = (fit_found(surface, found, girths_alone=True) for surface in (model, skin))
    except BodyError:
        return None
    return None if of_ellipsoids.rms_light[1] < _CLEARLY_LESS * of_skin.rms_light[1] else of_skin.model
