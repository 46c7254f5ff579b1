"""A body's surface is closed and faces outward."""

from dataclasses import replace

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Mesh, Part, Segment, has_flat_sides, surface_arrays
from tests.support.tolerances import EXACT, ROUNDTRIP

TURN = Rotation.from_euler("XYZ", [0.3, -0.8, 1.1])
CENTRE = np.array([0.3, -0.2, 0.5])
SIZE = np.array([0.2, 0.5, 0.9])


def body(*shapes):
    place = RigidTransform.from_components(CENTRE, TURN)
    parts = [Part(f"part{i}", shape, place, np.array([10.0, 20.0, i])) for i, shape in enumerate(shapes)]
    return BodyModel("body", (Segment("root", None, np.zeros(3), tuple(parts)),))


def loops(flat):
    return [flat.corners[a:b] for a, b in zip(flat.start, flat.start[1:], strict=False)]


def area_vector(loop):
    return 0.5 * sum(np.cross(a, b) for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True))


def icosphere():
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    return Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))


def test_box_is_six_rectangles_whose_normals_point_away_from_its_centre():
    flat = surface_arrays(body(Box(SIZE)))
    assert [len(loop) for loop in loops(flat)] == [4] * 6
    for loop, normal in zip(loops(flat), flat.normals, strict=True):
        outward = loop.mean(axis=0) - CENTRE
        np.testing.assert_allclose(normal, outward / np.linalg.norm(outward), atol=EXACT)


def test_box_has_its_size_along_its_own_axes():
    corners = TURN.inv().apply(surface_arrays(body(Box(SIZE))).corners - CENTRE)
    np.testing.assert_allclose(np.abs(corners), np.tile(SIZE / 2, (24, 1)), atol=EXACT)


def test_areas_of_a_closed_surface_sum_to_nothing_and_its_normals_agree_with_them():
    for shape in (Box(SIZE), icosphere()):
        flat = surface_arrays(body(shape))
        areas = np.array([area_vector(loop) for loop in loops(flat)])
        np.testing.assert_allclose(areas.sum(axis=0), 0, atol=ROUNDTRIP)
        np.testing.assert_allclose(flat.normals, areas / np.linalg.norm(areas, axis=1, keepdims=True), atol=ROUNDTRIP)


def test_polygons_enclose_the_shapes_volume():
    for shape, volume in ((Box(SIZE), SIZE.prod()), (icosphere(), trimesh.creation.icosphere(2, 0.3).volume)):
        flat = surface_arrays(body(shape))
        cones = [area_vector(loop) @ (loop.mean(axis=0) - CENTRE) / 3 for loop in loops(flat)]
        np.testing.assert_allclose(sum(cones), volume, atol=ROUNDTRIP)


def test_mesh_triangle_without_area_is_left_out():
    sphere = icosphere()
    pinched = Mesh(sphere.vertices_m, np.vstack([sphere.faces, [[0, 0, 1]]]))
    assert len(surface_arrays(body(pinched)).normals) == len(sphere.faces)


def test_parts_keep_their_numbers_across_kinds_of_shape():
    flat = surface_arrays(body(Box(SIZE), Ellipsoid(SIZE), icosphere(), Ellipsoid(SIZE)))
    np.testing.assert_array_equal(flat.ellipsoid_part, [1, 3])
    np.testing.assert_array_equal(np.unique(flat.polygon_part), [0, 2])
    np.testing.assert_array_equal(flat.colours[:, 2], [0, 1, 2, 3])


def test_ellipsoid_keeps_its_place_axes_and_semi_axes():
    flat = surface_arrays(body(Ellipsoid(SIZE)))
    np.testing.assert_allclose(flat.ellipsoid_centre, [CENTRE], atol=EXACT)
    np.testing.assert_allclose(flat.ellipsoid_axes, [TURN.as_matrix()], atol=EXACT)
    np.testing.assert_array_equal(flat.ellipsoid_semi_axes, [SIZE])


def test_slab_is_kept_and_an_ellipsoid_without_one_is_unlimited():
    whole = body(Ellipsoid(SIZE), Ellipsoid(SIZE))
    (segment,) = whole.segments
    parts = (segment.parts[0], replace(segment.parts[1], slab_m=(-0.1, 0.3)))
    flat = surface_arrays(replace(whole, segments=(replace(segment, parts=parts),)))
    np.testing.assert_array_equal(flat.ellipsoid_slab, [[-np.inf, np.inf], [-0.1, 0.3]])


def test_sides_are_flat_where_all_edges_are_sharp():
    cube, ball = trimesh.creation.box(extents=[0.1, 0.2, 0.3]), trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    assert has_flat_sides(Box(np.ones(3)))
    assert has_flat_sides(Mesh(np.asarray(cube.vertices), np.asarray(cube.faces)))
    assert not has_flat_sides(Mesh(np.asarray(ball.vertices), np.asarray(ball.faces)))
    assert not has_flat_sides(Ellipsoid(np.ones(3)))
