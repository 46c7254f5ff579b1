"""Does a mass fit a person? By the stature, and by the volume of the body's ellipsoids."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airborne.body.human import PARENTS
from airborne.body.model import BodyModel, Ellipsoid, Part
from airborne.body.shaping import total_mass_kg

# body mass index [kg/m2]; beyond is starvation, and the third class of obesity (WHO, Technical Report 894, 2000)
_BUILDS = (14.0, 40.0)
# of a person's ellipsoids, which overlap [kg/l], chosen: presets of 50 to 110 kg have 0.86 to 0.91, bodies fitted to
# synthetic people and to two recorded ones with their own masses 0.87 to 1.02; one fitted to 110 kg for 70 has 1.09
_DENSITIES = (0.80, 1.06)
_POUNDS_PER_KG = 2.2046  # of the international pound, 0.45359237 kg


def doubt_build(stature_m: float, mass_kg: float) -> Iterator[str]:
    """Yield what is odd about a stature and a mass, as a sentence; nothing of a person's."""
    index = mass_kg / stature_m**2
    if not _BUILDS[0] <= index <= _BUILDS[1]:
        yield (
            f"body: {mass_kg:g} kg at {stature_m:g} m is a body mass index of {index:.0f}; expected {_BUILDS[0]:.0f} "
            f"to {_BUILDS[1]:.0f}: check mass_kg and stature_m{_in_pounds(mass_kg, index, _BUILDS)}"
        )


def doubt_mass(model: BodyModel) -> Iterator[str]:
    """Yield that a person's mass does not fit the volume of its ellipsoids, as a sentence; nothing where it does.

    Nor of another body, nor where a segment has no mass.
    """
    density = density_kg_per_l(model)
    if density is None or _DENSITIES[0] <= density <= _DENSITIES[1]:
        return
    low, high = _DENSITIES
    mass_kg = total_mass_kg(model)
    much = "large" if density > high else "small"
    yield (
        f"body: {mass_kg:.1f} kg are {density:.2f} kg a litre of its ellipsoids; expected {low:.2f} to {high:.2f}: the "
        f"mass is too {much}, or the body too {'small' if density > high else 'large'}, and angular momentum is wrong "
        f"with it; weigh, and measure the stature{_in_pounds(mass_kg, density, _DENSITIES)}"
    )


def density_kg_per_l(model: BodyModel) -> float | None:
    """Return a person's mass over the volume of its ellipsoids, each by itself; None of another body or without masses.

    Segments reach into each other, so that it is below a person's own.
    """
    is_person = [segment.name for segment in model.segments] == list(PARENTS)
    if not is_person or any(segment.inertia is None for segment in model.segments):
        return None
    volume_m3 = sum(_volume_m3(part) for part in model.parts)
    return total_mass_kg(model) / (1000 * volume_m3) if volume_m3 > 0 else None


def _volume_m3(part: Part) -> float:
    """Return the volume of an ellipsoid within its slab; of another shape NaN."""
    if not isinstance(part.shape, Ellipsoid):
        return np.nan
    half = part.shape.semi_axes_m
    low, high = np.clip(np.array(part.slab_m) / half[2], -1, 1)
    return float(np.pi * half.prod() * (high - low - (high**3 - low**3) / 3))


def _in_pounds(mass_kg: float, value: float, expected: tuple[float, float]) -> str:
    """Say what the mass would be in pounds where that would do."""
    if not expected[0] <= value / _POUNDS_PER_KG <= expected[1]:
        return ""
    return f"; were it in pounds, it would be {mass_kg / _POUNDS_PER_KG:.1f} kg"
