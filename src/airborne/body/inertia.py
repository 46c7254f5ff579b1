"""Mass, centre of mass and inertia tensor: of combined pieces, and of a whole body in a pose."""

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
    centre, tensor = _combine(mass, centres, tensors)
    return Inertia(float(mass.sum()), centre, tensor)


def transform_inertia(inertia: Inertia, R: Array, t: Array) -> Inertia:
    """Express an inertia in another frame: R (3, 3) and t (3,) [m] take its frame to that one."""
    return Inertia(inertia.mass_kg, R @ inertia.centre_m + t, R @ inertia.tensor_kg_m2 @ R.T)


def total_inertias(model: BodyModel, R: Array, t: Array) -> tuple[float, Array, Array]:
    """Find the mass [kg], the centres of mass (n, 3) [m] and the tensors about them (n, 3, 3) [kg m^2] of n poses.

    R (n, s, 3, 3), t (n, s, 3) [m]: world from segment. World axes. Raises BodyError for a body with a segment of
    unknown inertia.
    """
    mass, local_centres, local_tensors = segment_inertias(model)
    centres = np.einsum("nsij,sj->nsi", R, local_centres) + t
    tensors = np.einsum("nsij,sjk,nslk->nsil", R, local_tensors, R)
    centre, tensor = _combine(mass, centres, tensors)
    return float(mass.sum()), centre, tensor


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


def _combine(mass: Array, centres: Array, tensors: Array) -> tuple[Array, Array]:
    """Combine s pieces, mass (s,), centres (..., s, 3), tensors (..., s, 3, 3): centre (..., 3), tensor (..., 3, 3)."""
    centre = np.einsum("s,...si->...i", mass, centres) / mass.sum()
    arm = centres - centre[..., None, :]
    square = np.einsum("s,...si,...si->...", mass, arm, arm)
    parallel = square[..., None, None] * np.eye(3) - np.einsum("s,...si,...sj->...ij", mass, arm, arm)
    return centre, tensors.sum(axis=-3) + parallel
