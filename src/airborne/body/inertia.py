"""Mass, centre of mass and inertia tensor of combined pieces, and of a body's segments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.body.model import BodyModel, Inertia
from airborne.errors import BodyError
from airborne.types import Array


def combine_inertias(pieces: Sequence[Inertia]) -> Inertia:
    """Combine pieces given in one frame (parallel-axis theorem)."""
    mass = np.array([piece.mass_kg for piece in pieces])
    centres = np.array([piece.centre_m for piece in pieces])
    tensors = np.array([piece.tensor_kg_m2 for piece in pieces])
    centre = np.einsum("s,si->i", mass, centres) / mass.sum()
    arm = centres - centre
    square = np.einsum("s,si,si->", mass, arm, arm)
    parallel = square * np.eye(3) - np.einsum("s,si,sj->ij", mass, arm, arm)
    return Inertia(float(mass.sum()), centre, tensors.sum(axis=0) + parallel)


def transform_inertia(inertia: Inertia, R: Array, t: Array) -> Inertia:
    """Express an inertia in another frame: R (3, 3) and t (3,) [m] take its frame to that one."""
    return Inertia(inertia.mass_kg, R @ inertia.centre_m + t, R @ inertia.tensor_kg_m2 @ R.T)


def segment_inertias(model: BodyModel) -> tuple[Array, Array, Array]:
    """Stack the segments' masses (s,) [kg], centres (s, 3) [m] and tensors (s, 3, 3) [kg m^2], in segment frames.

    Raises BodyError for a body with a segment of unknown inertia.
    """
    inertias = [segment.inertia for segment in model.segments if segment.inertia is not None]
    if len(inertias) < len(model.segments):
        missing = next(segment.name for segment in model.segments if segment.inertia is None)
        raise BodyError(
            f"body '{model.name}': the mass of segment '{missing}' is not known; give every segment a "
            "[segment.inertia], or use the preset human18"
        )
    return (
        np.array([inertia.mass_kg for inertia in inertias]),
        np.array([inertia.centre_m for inertia in inertias]),
        np.array([inertia.tensor_kg_m2 for inertia in inertias]),
    )
