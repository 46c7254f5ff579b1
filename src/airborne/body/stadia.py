"""Solids between two stadium-shaped sections: mass, centre, tensor and volume (Yeadon 1990-II, appendix 2).

A stadium is a rectangle with a half disc at either end: half the flat side t, radius r of the ends; t = 0 is a circle.
Along a solid both change linearly, so that every moment is a polynomial of the height and four Gauss nodes are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airborne.body.model import Inertia
from airborne.types import Array

_NODES, _WEIGHTS = (values / 2 for values in np.polynomial.legendre.leggauss(4))
_NODES = _NODES + 0.5


class SolidProperties(NamedTuple):
    """The inertia and the volume of a piece of a body."""

    inertia: Inertia
    volume_m3: float


@dataclass(frozen=True, slots=True)
class Stadium:
    """A stadium-shaped section of a body, wide along x."""

    flat_m: float  # half the length of the flat sides
    radius_m: float


def stadium(perimeter_m: float, width_m: float) -> Stadium:
    """Make the section of a perimeter and a width; one deeper than wide becomes a circle of its perimeter (Yeadon)."""
    if perimeter_m >= np.pi * width_m:
        return circle(perimeter_m)
    scale = 2 * np.pi - 4
    return Stadium((np.pi * width_m - perimeter_m) / scale, (perimeter_m - 2 * width_m) / scale)


def circle(perimeter_m: float) -> Stadium:
    """Make the round section of a perimeter."""
    return Stadium(0.0, perimeter_m / (2 * np.pi))


def solid(low: Stadium, high: Stadium, height_m: float, density: float, *, is_turned: bool = False) -> SolidProperties:
    """Fill the space between two sections; the origin is the centre of the low one, z points to the high one.

    density [kg/m^3]; `is_turned`: the sections are wide along y.
    """
    t, r = _at_nodes(low, high)
    area = 4 * t * r + np.pi * r**2
    xx = 4 * r * t**3 / 3 + np.pi * r**2 * t**2 + 8 * r**3 * t / 3 + np.pi * r**4 / 4  # of x^2 over a section
    yy = 4 * r**3 * t / 3 + np.pi * r**4 / 4
    dz = height_m * _WEIGHTS
    z = height_m * _NODES
    volume = float(dz @ area)
    centre = float(dz @ (area * z)) / volume
    spread = density * np.array([dz @ xx, dz @ yy, dz @ (area * (z - centre) ** 2)])
    if is_turned:
        spread = spread[[1, 0, 2]]
    tensor = np.diag(spread.sum() - spread)
    return SolidProperties(Inertia(density * volume, np.array([0.0, 0.0, centre]), tensor), volume)


def half_solid(low: Stadium, high: Stadium, height_m: float, density: float, *, sign: float) -> SolidProperties:
    """Cut `solid` in the plane x = 0 and keep the half where sign * x > 0; same frame."""
    whole = solid(low, high, height_m, density)
    t, r = _at_nodes(low, high)
    moment = t**2 * r + np.pi * r**2 / 2 * (t + 4 * r / (3 * np.pi))  # of x over half a section
    x_dm = sign * density * height_m * _WEIGHTS * moment
    mass, middle = whole.inertia.mass_kg / 2, whole.inertia.centre_m
    x = x_dm.sum() / mass
    tensor = whole.inertia.tensor_kg_m2 / 2 - mass * x**2 * np.diag([0.0, 1.0, 1.0])
    tensor[0, 2] = tensor[2, 0] = -x_dm @ (height_m * _NODES - middle[2])
    return SolidProperties(Inertia(mass, middle + np.array([x, 0.0, 0.0]), tensor), whole.volume_m3 / 2)


def dome(perimeter_m: float, height_m: float, density: float) -> SolidProperties:
    """Make half an ellipsoid on a round base at z = 0."""
    radius = perimeter_m / (2 * np.pi)
    volume = 2 / 3 * np.pi * radius**2 * height_m
    mass, centre = density * volume, 3 / 8 * height_m
    side = mass * ((radius**2 + height_m**2) / 5 - centre**2)
    tensor = np.diag([side, side, 2 / 5 * mass * radius**2])
    return SolidProperties(Inertia(mass, np.array([0.0, 0.0, centre]), tensor), volume)


def _at_nodes(low: Stadium, high: Stadium) -> tuple[Array, Array]:
    """Return t and r at the Gauss nodes: (4,), (4,) [m]."""
    return (
        low.flat_m + (high.flat_m - low.flat_m) * _NODES,
        low.radius_m + (high.radius_m - low.radius_m) * _NODES,
    )
