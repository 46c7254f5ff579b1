"""Light on surfaces, and its shadows."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Part, Pose, Segment
from airborne.rendering.srgb import light_from_srgb, srgb_from_light
from airborne.synthetic.throw.light import Ambient, Spot, boxes_of, ellipsoids_of, is_lit, spot_irradiance
from tests.support.tolerances import EXACT

UP = np.array([[0.0, 0.0, 1.0]])
SPOT = Spot(position=np.array([0.0, 0, 4]), target=np.zeros(3), light_at_1m=np.full(3, 8.0), cone_rad=0.5)


def box(centre, size, turn_rad=0.0):
    place = RigidTransform.from_components(np.array(centre, float), Rotation.from_euler("Z", turn_rad))
    parts = (Part("box", Box(np.array(size, float)), place, None),)
    model = BodyModel("box", (Segment("box", None, np.zeros(3), parts),))
    return model.with_pose(Pose(world_from_root=RigidTransform.identity()))


def test_light_falls_off_with_the_square_of_the_distance():
    light = spot_irradiance(SPOT, np.array([[0, 0, 0.0], [0, 0, 2.0]]), np.repeat(UP, 2, axis=0))
    np.testing.assert_allclose(light[:, 0], [8 / 16, 8 / 4], rtol=EXACT)


def test_light_goes_with_the_cosine_and_backs_stay_dark():
    tilted = np.array([[0, np.sin(1.0), np.cos(1.0)], [0, 0, -1]])
    light = spot_irradiance(SPOT, np.zeros((2, 3)), tilted)
    np.testing.assert_allclose(light[:, 1], [0.5 * np.cos(1.0), 0], atol=EXACT)


def test_cone_is_full_inside_dark_outside_and_never_brightens_outward():
    radius = 4 * np.tan(np.linspace(0, 0.6, 200))
    points = np.column_stack([radius, 0 * radius, 0 * radius])
    facing = SPOT.position - points
    normals = facing / np.linalg.norm(facing, axis=1, keepdims=True)
    power = spot_irradiance(SPOT, points, normals)[:, 0] * np.sum(facing**2, axis=1)
    angle = np.arctan(radius / 4)
    np.testing.assert_allclose(power[angle < 0.7 * 0.5], 8.0, rtol=EXACT)
    np.testing.assert_array_equal(power[angle > 0.5], 0)
    assert np.all(np.diff(power) <= EXACT)


def test_shadow_of_a_box_is_its_central_projection():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-2, 2, (4000, 2)), np.zeros(4000)])
    turn = 0.4
    lit = is_lit(points, np.repeat(UP, 4000, axis=0), SPOT, boxes_of(box((0.3, 0.1, 2), (0.8, 0.4, 1e-6), turn)))
    half_way = points[:, :2] / 2 - [0.3, 0.1]
    along = half_way @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    is_sure = np.abs(np.abs(along) - [0.4, 0.2]).min(axis=1) > 2e-3
    np.testing.assert_array_equal(lit[is_sure], ~np.all(np.abs(along) < [0.4, 0.2], axis=1)[is_sure])
    assert 100 < np.count_nonzero(~lit) < 2000


def test_box_shadows_neither_itself_nor_what_lies_before_it():
    boxes = boxes_of(box((0, 0, 0), (1, 1, 1)))
    top, beyond = np.array([[0.2, -0.3, 0.5]]), np.array([[0.0, 0.0, 3.0]])
    assert is_lit(top, UP, SPOT, boxes).all()
    assert is_lit(beyond, UP, SPOT, boxes).all()
    assert not is_lit(np.array([[0.2, 0.1, -0.6]]), UP, SPOT, boxes).any()


def test_ambient_light_is_the_mean_on_upright_surfaces():
    ambient = Ambient(np.array([0.3, 0.3, 0.4]), np.array([0.1, 0.1, 0.2]))
    normals = np.array([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]])
    np.testing.assert_allclose(ambient.irradiance(normals)[:, 2], [0.4, 0.2, 0.3], atol=EXACT)


def test_colours_come_back_from_linear_light():
    levels = np.arange(256)
    np.testing.assert_allclose(srgb_from_light(light_from_srgb(levels)), levels, atol=0.4)


def test_light_brighter_than_white_is_clipped():
    np.testing.assert_allclose(srgb_from_light(np.array([-0.1, 1.0, 7.0])), [0, 255, 255], atol=1e-4)


@pytest.mark.parametrize("level", [0, 10, 128, 255])
def test_srgb_agrees_with_its_standard_at_known_levels(level):
    is_known = {0: 0.0, 10: 0.003035, 128: 0.215861, 255: 1.0}
    assert light_from_srgb(np.array(level)) == pytest.approx(is_known[level], abs=1e-6)


NO_BOXES = np.zeros((0, 3, 4))


def ball(centre, semi_axes, turn=None):
    place = RigidTransform.from_components(np.array(centre, float), turn or Rotation.identity())
    parts = (Part("ball", Ellipsoid(np.array(semi_axes, float)), place, None),)
    model = BodyModel("ball", (Segment("ball", None, np.zeros(3), parts),))
    return model.with_pose(Pose(world_from_root=RigidTransform.identity()))


def test_shadow_of_an_ellipsoid_is_where_the_ray_comes_nearer_to_its_centre_than_its_core():
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-1.5, 1.5, (4000, 2)), np.zeros(4000)])
    turn, semi_axes, centre = (
        Rotation.from_rotvec([0.5, 0.9, -0.4]),
        np.array([0.2, 0.35, 0.5]),
        np.array([0.3, 0.1, 2]),
    )
    lit = is_lit(
        points, np.repeat(UP, 4000, axis=0), SPOT, NO_BOXES, ellipsoids=ellipsoids_of(ball(centre, semi_axes, turn))
    )
    start, end = (turn.inv().apply(p - centre) / semi_axes for p in (points, SPOT.position[None]))
    way = end - start
    nearest = start - np.sum(start * way, axis=1, keepdims=True) / np.sum(way**2, axis=1, keepdims=True) * way
    distance = np.linalg.norm(nearest, axis=1)
    is_sure = np.abs(distance - 0.93) > 5e-3
    np.testing.assert_array_equal(lit[is_sure], (distance > 0.93)[is_sure])
    assert 100 < np.count_nonzero(~lit) < 2000


def test_ellipsoid_shades_no_point_inside_it_before_it_or_beside_the_ray():
    spheres = ellipsoids_of(ball((0, 0, 1), (0.5, 0.5, 0.5)))
    points = np.array([[0, 0, 1.0], [0.1, 0, 1.3], [0, 0, 3.0], [1.5, 0, 1.0], [0, 0, 0.0]])
    lit = is_lit(points, np.repeat(UP, 5, axis=0), SPOT, NO_BOXES, ellipsoids=spheres)
    np.testing.assert_array_equal(lit, [True, True, True, True, False])


def test_two_parts_cut_from_one_ellipsoid_block_light_as_one():
    whole = Part("ball", Ellipsoid(np.ones(3)), RigidTransform.identity(), None)
    halves = tuple(
        Part(name, whole.shape, whole.segment_from_part, None, slab)
        for name, slab in (("below", (-np.inf, 0.1)), ("above", (0.1, np.inf)))
    )
    posed = [
        BodyModel("ball", (Segment("ball", None, np.zeros(3), parts),)).with_pose(
            Pose(world_from_root=RigidTransform.identity())
        )
        for parts in ((whole,), halves)
    ]
    np.testing.assert_array_equal(ellipsoids_of(posed[0]), ellipsoids_of(posed[1]))
