"""Solids between stadium-shaped sections, against sums of small pieces and closed forms."""

import numpy as np
import pytest

from airborne.body.inertia import combine_inertias, transform_inertia
from airborne.body.stadia import Stadium, circle, dome, half_solid, solid, stadium
from tests.support.tolerances import EXACT, ROUNDTRIP

WIDE, NARROW, ROUND = Stadium(0.09, 0.06), Stadium(0.05, 0.08), Stadium(0.0, 0.07)
CUBES = 4e-3  # relative, of a sum over millimetre cubes


def cubes(low, high, height, density, keep=lambda x: x == x):
    """Fill a solid with cubes: mass of one, places (n, 3)."""
    side = 0.002
    x, y = np.meshgrid(np.arange(-0.16, 0.16, side) + side / 2, np.arange(-0.1, 0.1, side) + side / 2, indexing="ij")
    places = []
    for z in (np.arange(60) + 0.5) / 60:
        flat = low.flat_m + (high.flat_m - low.flat_m) * z
        radius = low.radius_m + (high.radius_m - low.radius_m) * z
        inside = (np.hypot(np.clip(np.abs(x) - flat, 0, None), y) < radius) & keep(x)
        places.append(np.column_stack([x[inside], y[inside], np.full(inside.sum(), z * height)]))
    return density * side**2 * height / 60, np.concatenate(places)


def assert_is(properties, mass, places):
    """Compare a properties with equal point masses."""
    total, centre = mass * len(places), places.mean(axis=0)
    spread = mass * (places - centre).T @ (places - centre)
    tensor = np.trace(spread) * np.eye(3) - spread
    assert properties.inertia.mass_kg == pytest.approx(total, rel=CUBES)
    np.testing.assert_allclose(properties.inertia.centre_m, centre, atol=3e-4)
    np.testing.assert_allclose(properties.inertia.tensor_kg_m2, tensor, atol=CUBES * np.abs(tensor).max())


@pytest.mark.parametrize("sections", [(WIDE, NARROW), (ROUND, WIDE), (NARROW, ROUND), (ROUND, Stadium(0.0, 0.03))])
def test_a_solid_is_the_sum_of_its_small_cubes(sections):
    assert_is(solid(*sections, 0.12, 1000.0), *cubes(*sections, 0.12, 1000.0))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_half_solid_is_the_sum_of_its_small_cubes(sign):
    properties = half_solid(WIDE, Stadium(0.04, 0.03), 0.12, 1000.0, sign=sign)
    assert_is(properties, *cubes(WIDE, Stadium(0.04, 0.03), 0.12, 1000.0, keep=lambda x: sign * x > 0))
    assert abs(properties.inertia.tensor_kg_m2[0, 2]) > 10 * CUBES * 1e-3, "the half leans inward"


def test_two_halves_are_the_whole():
    halves = [half_solid(WIDE, NARROW, 0.1, 900.0, sign=sign).inertia for sign in (1, -1)]
    whole, both = solid(WIDE, NARROW, 0.1, 900.0).inertia, combine_inertias(halves)
    np.testing.assert_allclose(both.centre_m, whole.centre_m, atol=EXACT)
    np.testing.assert_allclose(both.tensor_kg_m2, whole.tensor_kg_m2, atol=EXACT)


def test_a_cylinder_and_a_cone_are_those_of_the_textbook():
    cylinder = solid(ROUND, ROUND, 0.3, 1000.0).inertia
    assert cylinder.mass_kg == pytest.approx(1000 * np.pi * 0.07**2 * 0.3, rel=EXACT)
    np.testing.assert_allclose(
        np.diag(cylinder.tensor_kg_m2) / cylinder.mass_kg,
        [0.07**2 / 4 + 0.3**2 / 12] * 2 + [0.07**2 / 2],
        rtol=ROUNDTRIP,
    )
    cone = solid(ROUND, Stadium(0.0, 1e-12), 0.4, 1000.0)
    assert cone.volume_m3 == pytest.approx(np.pi * 0.07**2 * 0.4 / 3, rel=ROUNDTRIP)
    assert cone.inertia.centre_m[2] == pytest.approx(0.1, rel=ROUNDTRIP)


def test_a_dome_is_half_an_ellipsoid():
    half = dome(2 * np.pi * 0.09, 0.11, 1100.0)
    mirror = np.diag([1.0, -1.0, -1.0])
    whole = combine_inertias([half.inertia, transform_inertia(half.inertia, mirror, np.zeros(3))])
    assert whole.mass_kg == pytest.approx(1100 * 4 / 3 * np.pi * 0.09**2 * 0.11, rel=EXACT)
    expected = whole.mass_kg / 5 * np.array([0.09**2 + 0.11**2] * 2 + [2 * 0.09**2])
    np.testing.assert_allclose(whole.tensor_kg_m2, np.diag(expected), atol=EXACT)


def test_upside_down_and_cut_in_two_a_solid_is_the_same():
    whole = solid(WIDE, NARROW, 0.2, 1000.0).inertia
    turned = transform_inertia(solid(NARROW, WIDE, 0.2, 1000.0).inertia, np.diag([1.0, -1, -1]), np.array([0, 0, 0.2]))
    middle = Stadium(0.07, 0.07)
    upper = transform_inertia(solid(middle, NARROW, 0.1, 1000.0).inertia, np.eye(3), np.array([0, 0, 0.1]))
    cut = combine_inertias([solid(WIDE, middle, 0.1, 1000.0).inertia, upper])
    for other in (turned, cut):
        np.testing.assert_allclose(other.mass_kg, whole.mass_kg, rtol=EXACT)
        np.testing.assert_allclose(other.centre_m, whole.centre_m, atol=EXACT)
        np.testing.assert_allclose(other.tensor_kg_m2, whole.tensor_kg_m2, atol=EXACT)


def test_a_rotated_solid_is_wide_from_front_to_back():
    plain, turned = solid(WIDE, ROUND, 0.2, 1000.0).inertia, solid(WIDE, ROUND, 0.2, 1000.0, is_turned=True).inertia
    quarter = transform_inertia(plain, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.zeros(3))
    np.testing.assert_allclose(turned.tensor_kg_m2, quarter.tensor_kg_m2, atol=EXACT)


@pytest.mark.parametrize("width", [0.3, 0.35, 0.32])
def test_a_section_has_its_perimeter_and_its_width(width):
    section = stadium(0.9, width)
    assert 4 * section.flat_m + 2 * np.pi * section.radius_m == pytest.approx(0.9, rel=EXACT)
    assert 2 * section.flat_m + 2 * section.radius_m == pytest.approx(width, rel=EXACT)


def test_a_section_deeper_than_wide_is_a_circle():
    assert stadium(0.9, 0.25) == circle(0.9) == Stadium(0.0, 0.9 / (2 * np.pi))
