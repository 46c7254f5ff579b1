"""Which turns of a body cannot be seen."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Mesh, Part, Segment
from airborne.body.model import WHOLE, Pose
from airborne.body.symmetry import continuous_axes, least_turned_pose, symmetries
from tests.support.tolerances import ROUNDTRIP

YELLOW, BLUE = np.array([231.0, 200.0, 48.0]), np.array([0.0, 0.0, 200.0])
HALF_TURN_Y = np.diag([-1.0, 1.0, -1.0])
CUBE_VERTICES = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
CUBE_QUADS = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
CUBE_FACES = np.concatenate([CUBE_QUADS[:, :3], CUBE_QUADS[:, (0, 2, 3)]])


def body(*parts):
    return BodyModel("body", (Segment("root", None, np.zeros(3), parts),))


def part(shape, centre=(0, 0, 0), colour=YELLOW, rotation=None, slab_m=WHOLE):
    turn = rotation or Rotation.identity()
    return Part("part", shape, RigidTransform.from_components(np.array(centre, float), turn), colour, slab_m)


def box(*size):
    return Box(np.array(size, float))


def ellipsoid(*semi_axes):
    return Ellipsoid(np.array(semi_axes, float))


def cross(colour=YELLOW, short_centre=(0, 0.18, 0)):
    return body(part(box(0.06, 0.9, 0.045), colour=colour), part(box(0.6, 0.06, 0.045), short_centre, colour))


def test_thrown_cross_looks_the_same_after_half_a_turn_about_its_long_bar():
    found = symmetries(cross())
    assert len(found) == 2
    np.testing.assert_array_equal(found[0], np.eye(3))
    np.testing.assert_array_equal(found[1], HALF_TURN_Y)


def test_cross_with_bars_through_one_centre_has_all_half_turns():
    assert len(symmetries(cross(short_centre=(0, 0, 0)))) == 4


def test_cross_with_bars_not_yet_coloured_has_the_symmetry_of_its_shape():
    assert len(symmetries(cross(colour=None))) == 2


def test_cube_has_all_symmetries_and_a_brick_the_half_turns():
    assert len(symmetries(body(part(box(1, 1, 1))))) == 24
    assert len(symmetries(body(part(box(1, 2, 3))))) == 4


def test_identity_is_the_only_symmetry_of_a_body_with_one_odd_part():
    assert len(symmetries(body(part(box(1, 2, 3)), part(ellipsoid(0.1, 0.1, 0.1), (0.2, 0.9, 1.4))))) == 1


def test_two_twin_bricks_swap_only_when_their_colours_agree():
    bricks = [part(box(1, 0.2, 0.3), (0, y, 0)) for y in (-1, 1)]
    repainted = [bricks[0], part(box(1, 0.2, 0.3), (0, 1, 0), BLUE)]
    assert len(symmetries(body(*bricks))) == 4
    assert len(symmetries(body(*repainted))) == 2


def test_twin_bricks_without_colours_are_not_taken_for_the_same():
    bricks = [part(box(1, 0.2, 0.3), (0, y, 0), None) for y in (-1, 1)]
    assert len(symmetries(body(*bricks))) == 2


def test_symmetries_form_a_group():
    found = symmetries(body(part(box(1, 1, 2)), part(ellipsoid(0.5, 0.5, 0.5), (0, 0, 1)), part(box(1, 1, 2))))
    assert len(found) == 4
    for A in found:
        for B in found:
            assert any(np.allclose(A @ B, C, atol=ROUNDTRIP) for C in found)


def test_how_a_parts_own_axes_are_named_does_not_matter():
    turned = part(box(2, 1, 1), rotation=Rotation.from_euler("Z", 90, degrees=True))
    plain = part(box(1, 2, 1))
    assert len(symmetries(body(turned))) == len(symmetries(body(plain))) == 8


def test_mesh_cube_has_the_half_turns_its_triangles_allow_and_the_identity():
    mesh = part(Mesh(CUBE_VERTICES * [1, 2, 3], CUBE_FACES))
    found = symmetries(body(mesh))
    np.testing.assert_array_equal(found[0], np.eye(3))
    assert all(np.allclose(R, np.diag(np.diag(R))) for R in found)


def test_mesh_with_repeated_vertices_still_looks_like_itself():
    soup = CUBE_VERTICES[CUBE_FACES].reshape(-1, 3)
    assert len(symmetries(body(part(Mesh(soup, np.arange(len(soup)).reshape(-1, 3)))))) >= 1


def test_parts_of_jointed_segments_count_at_their_positions():
    root = Segment("root", None, np.zeros(3), (part(box(1, 0.2, 0.3)),))
    arms = [Segment(f"arm{y}", "root", np.array([0.0, y, 0]), (part(box(0.1, 0.1, 0.1)),)) for y in (-1, 1)]
    assert len(symmetries(BodyModel("b", (root, *arms)))) == 4
    assert len(symmetries(BodyModel("b", (root, arms[0])))) == 2


@pytest.mark.parametrize(
    ("parts", "axes"),
    [
        ([part(ellipsoid(1, 1, 1))], 3),
        ([part(ellipsoid(1, 1, 2))], 1),
        ([part(ellipsoid(2, 1, 1), (0.5, 0, 0)), part(ellipsoid(1, 1, 1), (2, 0, 0))], 1),
        ([part(ellipsoid(1, 1, 1), (0.5, 0, 0)), part(ellipsoid(1, 1, 1), (0, 2, 0))], 0),
        ([part(ellipsoid(1, 1, 2)), part(ellipsoid(2, 1, 1))], 0),
        ([part(ellipsoid(1, 2, 3))], 0),
        ([part(ellipsoid(1, 1, 1), slab_m=(-np.inf, 0.2))], 1),
        ([part(ellipsoid(1, 1, 2), slab_m=(-0.3, 0.2))], 1),
        ([part(ellipsoid(1, 2, 2), slab_m=(-0.3, 0.2))], 0),
        ([part(ellipsoid(1, 2, 2), slab_m=(-3, 3))], 1),
        ([part(box(1, 1, 2))], 0),
        ([part(ellipsoid(1, 1, 2)), part(box(1, 1, 1))], 0),
    ],
)
def test_only_spheroids_and_spheres_on_one_axis_can_rotate_unseen(parts, axes):
    assert len(continuous_axes(body(*parts))) == axes


def test_a_ball_cut_at_one_end_keeps_the_turns_about_its_axis_and_one_cut_evenly_can_be_upended():
    ball, up = ellipsoid(1, 1, 1), [0, 0, 1]
    cap, band = body(part(ball, slab_m=(0.4, np.inf))), body(part(ball, slab_m=(-0.4, 0.4)))
    assert all(np.allclose(R @ up, up) for R in symmetries(cap)) and len(symmetries(cap)) == 4
    assert all(np.allclose(np.abs(R @ up), up) for R in symmetries(band)) and len(symmetries(band)) == 8


def test_two_halves_of_a_ball_swap_only_when_their_colours_agree():
    halves = [part(ellipsoid(1, 1, 1), slab_m=slab) for slab in ((-np.inf, 0), (0, np.inf))]
    repainted = [halves[0], part(ellipsoid(1, 1, 1), slab_m=(0, np.inf), colour=BLUE)]
    assert len(symmetries(body(*halves))) == 8
    assert len(symmetries(body(*repainted))) == 4


def test_undetectable_rotation_is_about_the_spheroids_own_axis():
    place = Rotation.from_euler("XYZ", [0.3, 0.4, 0.5])
    (axis,) = continuous_axes(body(part(ellipsoid(0.1, 0.1, 0.3), rotation=place)))
    np.testing.assert_allclose(np.abs(axis @ place.as_matrix()), [0, 0, 1], atol=ROUNDTRIP)


@pytest.mark.parametrize("turn_deg", [(0, 0, 170), (80, 10, 0), (5, 100, 0), (-60, 200, 30)])
def test_of_poses_that_look_alike_the_least_turned_is_taken_whichever_is_found(turn_deg):
    found = Rotation.from_euler("xyz", turn_deg, degrees=True)
    alike = [found * Rotation.from_matrix(each) for each in symmetries(cross())]
    assert len(alike) > 1
    taken = [
        least_turned_pose(cross(), Pose(world_from_root=RigidTransform.from_rotation(each))).world_from_root.rotation
        for each in alike
    ]
    for each in taken:
        assert each.magnitude() == pytest.approx(min(other.magnitude() for other in alike))
        assert (each.inv() * taken[0]).magnitude() < ROUNDTRIP


def turned(profile, sides=24, offset=0.0):
    """A mesh turned about z: profile (n, 2) of radius and height, closed by the axis at both ends."""
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rings = [[(r * np.cos(a) + offset, r * np.sin(a), z) for a in angles] for r, z in profile]
    vertices = np.array(rings).reshape(-1, 3)
    faces = []
    for ring in range(len(profile) - 1):
        for k in range(sides):
            a, b = ring * sides + k, ring * sides + (k + 1) % sides
            faces += [(a, b, a + sides), (b, b + sides, a + sides)]
    return Mesh(vertices, np.array(faces))


CLUB = [(0.0, 0.0), (0.015, 0.0), (0.012, 0.2), (0.05, 0.4), (0.03, 0.5), (0.0, 0.5)]
BALL = [(0.1 * np.sin(a), -0.1 * np.cos(a)) for a in np.linspace(0, np.pi, 16)]


def test_mesh_that_was_turned_has_its_axis():
    handle, head = turned(CLUB[:4]), turned(CLUB[3:])
    np.testing.assert_array_equal(continuous_axes(body(part(handle), part(head, colour=BLUE))), [[0, 0, 1]])


def test_turned_mesh_lies_along_the_axis_of_a_spheroid():
    upright, across = part(ellipsoid(0.02, 0.02, 0.1)), part(ellipsoid(0.1, 0.02, 0.02))
    np.testing.assert_array_equal(np.abs(continuous_axes(body(part(turned(CLUB)), upright))), [[0, 0, 1]])
    assert len(continuous_axes(body(part(turned(CLUB)), across))) == 0


def test_mesh_of_a_ball_looks_the_same_about_every_axis():
    assert len(continuous_axes(body(part(turned(BALL, sides=32))))) == 3


@pytest.mark.parametrize(
    "parts",
    [
        [part(turned(CLUB, sides=6))],
        [part(turned(CLUB, offset=0.02))],
        [part(Mesh(CUBE_VERTICES, CUBE_FACES))],
        [part(turned(CLUB)), part(box(0.1, 0.1, 0.1))],
        [part(turned(CLUB)), part(ellipsoid(0.02, 0.02, 0.02), (0.1, 0, 0))],
    ],
    ids=["six sides", "beside its origin", "cube", "with a box", "with a knob"],
)
def test_mesh_that_is_not_round_has_no_axis(parts):
    assert len(continuous_axes(body(*parts))) == 0
