"""A rational surface is what another library says it is, and holds stadia exactly."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.optimize import brentq

from airborne.body.nurbs import RationalSurface, stadium_loft
from airborne.errors import BodyError
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED

U = np.linspace(0, 1, 4001)


def loft(*sections):
    """Sections (place, half straight side, radius) between two tips."""
    first, last = sections[0][0], sections[-1][0]
    rows = [(first - 0.1, 0, 0), *sections, (last + 0.1, 0, 0)]
    return stadium_loft(np.array([(*row, 0.0, 0.0) for row in rows], float))


def random_surface(seed=0, degrees=(2, 3), counts=(9, 7)):
    rng = np.random.default_rng(seed)
    points, weights = rng.normal(0, 1, (*counts, 3)), rng.uniform(0.4, 2, counts)
    points[-1], weights[-1] = points[0], weights[0]
    knots = [
        np.concatenate([np.zeros(degree), np.linspace(0, 1, count - degree + 1), np.ones(degree)])
        for degree, count in zip(degrees, counts, strict=True)
    ]
    return RationalSurface(degrees, (knots[0], knots[1]), points, weights)


def section_at(surface, place):
    """The closed curve of a loft at the station whose control points lie at a place."""
    v = brentq(lambda v: surface.points(np.zeros(1), np.array([v]))[0, 0, 2] - place, 0, 1, xtol=EXACT)
    return surface.points(U, np.array([v]))[:, 0]


def perimeter_and_area(curve):
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    areas = [a[0] * b[1] - b[0] * a[1] for a, b in pairwise(curve)]
    return steps.sum(), sum(areas) / 2


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degrees", [(2, 3), (3, 2), (1, 1)])
def test_points_and_normals_are_those_of_geomdl(seed, degrees):
    nurbs = pytest.importorskip("geomdl.NURBS")
    surface = random_surface(seed, degrees)
    other = nurbs.Surface()
    other.degree_u, other.degree_v = degrees
    weights = surface.weights[..., None]
    other.ctrlpts2d = np.concatenate([surface.points_m * weights, weights], axis=-1).tolist()
    other.knotvector_u, other.knotvector_v = (knots.tolist() for knots in surface.knots)
    u, v = np.linspace(0.02, 0.97, 6), np.linspace(0.03, 0.96, 5)
    derivatives = np.array([[other.derivatives(a, b, order=1) for b in v] for a in u], dtype=object)
    places = np.array(derivatives[:, :, 0, 0].tolist())
    crosses = np.cross(np.array(derivatives[:, :, 1, 0].tolist()), np.array(derivatives[:, :, 0, 1].tolist()))
    np.testing.assert_allclose(surface.points(u, v), places, atol=ROUNDTRIP)
    unit = crosses / np.linalg.norm(crosses, axis=-1, keepdims=True)
    np.testing.assert_allclose(surface.normals(u, v), unit, atol=ROUNDTRIP)


@pytest.mark.parametrize(("flat", "radius"), [(0.1, 0.05), (0.02, 0.08), (0.3, 0.01), (0.0, 0.06)])
def test_a_section_has_the_perimeter_and_area_of_its_stadium(flat, radius):
    surface = loft((0, flat, radius), (0.2, flat, radius), (0.4, flat, radius), (0.6, flat, radius))
    perimeter, area = perimeter_and_area(section_at(surface, 0.2))
    assert perimeter == pytest.approx(4 * flat + 2 * np.pi * radius, rel=1e-5)
    assert area == pytest.approx(4 * flat * radius + np.pi * radius**2, rel=1e-5)


def test_every_point_of_a_section_lies_on_the_stadium():
    surface = loft((0, 0.1, 0.05), (0.3, 0.04, 0.08), (0.5, 0.06, 0.02))
    curve = section_at(surface, 0.3)
    beyond = np.maximum(np.abs(curve[:, 0]) - 0.04, 0)  # from the straight middle
    np.testing.assert_allclose(np.hypot(beyond, curve[:, 1]), 0.08, atol=1e-7)


def test_a_loft_passes_through_its_stations_off_centre_too():
    stations = np.array(
        [[0, 0, 0, 0.01, 0], [0.1, 0.05, 0.02, 0.01, -0.02], [0.2, 0.04, 0.03, 0, 0.03], [0.3, 0, 0, 0, 0]]
    )
    surface = stadium_loft(stations)
    for at, flat, radius, x, y in stations[1:-1]:
        curve = section_at(surface, at)
        np.testing.assert_allclose(
            [curve[:, 0].min(), curve[:, 0].max()], [x - flat - radius, x + flat + radius], atol=1e-6
        )
        np.testing.assert_allclose([curve[:, 1].min(), curve[:, 1].max()], [y - radius, y + radius], atol=1e-6)


def test_normals_are_the_directions_in_which_the_surface_does_not_move():
    surface, h = loft((0, 0.1, 0.05), (0.3, 0.04, 0.08), (0.5, 0.06, 0.02)), 1e-5
    u, v = np.array([0.03, 0.21, 0.37, 0.62, 0.9]), np.array([0.2, 0.45, 0.8])
    normals = surface.normals(u, v)
    for shifted in (
        surface.points(u + h, v) - surface.points(u - h, v),
        surface.points(u, v + h) - surface.points(u, v - h),
    ):
        np.testing.assert_allclose(np.sum(shifted / (2 * h) * normals, axis=-1), 0, atol=SOLVED)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=EXACT)


def test_a_mesh_is_closed_and_smooth_and_fills_the_solid():
    radius, length = 0.1, 0.4
    angle = np.linspace(-np.pi / 2, 0, 10)
    end = np.stack([radius * np.sin(angle), radius * np.cos(angle)], axis=1)
    end[0, 1] = 0
    rod = np.stack([np.linspace(0, length, 21)[1:-1], np.full(19, radius)], axis=1)
    places, radii = np.vstack([end, rod, end[::-1] * [-1, 1] + [length, 0]]).T
    zero = np.zeros(len(places))
    mesh = stadium_loft(np.stack([places, zero, radii, zero, zero], axis=1)).mesh(80, 81)
    solid = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    assert solid.is_watertight and solid.is_winding_consistent
    assert solid.volume == pytest.approx(np.pi * radius**2 * (4 / 3 * radius + length), rel=0.01)
    assert np.all(np.sum(mesh.normals[mesh.faces].mean(axis=1) * solid.face_normals, axis=1) > 0.98)


def test_a_loft_symmetric_in_its_sections_has_a_symmetric_mesh():
    mesh = loft((0, 0.1, 0.05), (0.3, 0.04, 0.08), (0.5, 0.06, 0.02)).mesh(24, 15)
    for mirror in ([-1, 1, 1], [1, -1, 1]):
        mirrored = np.round(mesh.vertices_m * mirror, 9) + 0.0
        assert {tuple(p) for p in mirrored} == {tuple(p) for p in np.round(mesh.vertices_m, 9) + 0.0}


def test_what_is_no_closed_surface_is_refused():
    surface = random_surface()
    with pytest.raises(BodyError, match="knots in u"):
        RationalSurface((3, 3), surface.knots, surface.points_m, surface.weights)
    with pytest.raises(BodyError, match="weights above zero"):
        RationalSurface((2, 3), surface.knots, surface.points_m, -surface.weights)
    torn = surface.points_m.copy()
    torn[0] += 0.1
    with pytest.raises(BodyError, match="close around"):
        RationalSurface((2, 3), surface.knots, torn, surface.weights)
    with pytest.raises(BodyError, match="close it to a point"):
        surface.mesh(12, 10)
    with pytest.raises(BodyError, match="four sections"):
        stadium_loft(np.zeros((3, 5)))
