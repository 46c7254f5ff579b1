import numpy as np

from airborne.rendering import FLAT, Lamp, Lights, render
from airborne.rendering.maps import empty_maps, surface_maps
from airborne.rendering.packing import pack_lights, pack_view
from airborne.rendering.shapes import new_shapes
from tests.support.bodies import camera, posed_random
from tests.support.tolerances import SOLVED

LIT = Lights(0.3, (Lamp(np.array([2.0, -3.0, 4.0]), 0.6),))


def test_surface_maps_are_the_rendering_with_normals_that_point_at_the_camera():
    shapes, posed = posed_random(["ellipsoid", "box", "mesh", "slab"], 1)
    seen_by = camera(turn=0.7)
    part, inverse_depth, normals = empty_maps(seen_by.size)
    surface_maps(new_shapes(shapes), shapes, posed.R, posed.t, pack_view(seen_by), part, inverse_depth, normals)
    drawn = render(shapes, posed, seen_by, FLAT)
    assert np.array_equal(part, drawn.part)
    is_flat = np.isin(part, [1, 2])  # the box and the mesh
    assert is_flat.any()
    assert np.array_equal(inverse_depth[is_flat], drawn.inverse_depth[is_flat])
    is_round = np.isin(part, [0, 3])  # the outline lies behind the visible surface
    assert np.all(inverse_depth[is_round] <= drawn.inverse_depth[is_round] + 1e-6)
    assert np.all(inverse_depth[is_round] > 0)
    v, u = np.nonzero(drawn.mask)
    rays = np.stack([u, v, np.ones_like(u)], axis=1) @ np.linalg.inv(seen_by.K).T
    visible = normals[:, v, u].T
    np.testing.assert_allclose(np.linalg.norm(visible, axis=1), 1, rtol=SOLVED)
    assert np.all(np.sum(visible * rays, axis=1) < 1e-3)


def test_parts_and_depths_are_the_same_without_normals():
    shapes, posed = posed_random(["ellipsoid", "box", "mesh", "slab"], 1)
    seen_by = camera(turn=0.7)
    drawn, plain = empty_maps(seen_by.size), empty_maps(seen_by.size, with_normals=False)
    for maps in (drawn, plain):
        surface_maps(new_shapes(shapes), shapes, posed.R, posed.t, pack_view(seen_by), *maps)
    assert plain.normals.size == 0
    for with_normals, without in zip(drawn[:2], plain[:2], strict=True):
        np.testing.assert_array_equal(with_normals, without)


def test_colours_under_lamps_are_the_renderings():
    shapes, posed = posed_random(["ellipsoid", "box", "mesh", "slab"], 1)
    seen_by, (part, inverse_depth, _) = camera(turn=0.7), empty_maps(camera(turn=0.7).size)
    colours, light = np.full((3, *part.shape), -1, np.float32), (pack_lights(LIT, seen_by), np.float32(LIT.ambient))
    packed = pack_view(seen_by)
    surface_maps(new_shapes(shapes), shapes, posed.R, posed.t, packed, part, inverse_depth, colours, *light)
    drawn = render(shapes, posed, seen_by, LIT)
    np.testing.assert_allclose(colours[:, drawn.mask], drawn.colour[drawn.mask].T, rtol=SOLVED)
    assert drawn.mask.any() and np.all(colours[:, ~drawn.mask] == -1)
    assert np.ptp(colours[0, part == 0]) > 10  # a lamp shades the ellipsoid
