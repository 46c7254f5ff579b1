import numpy as np

from airborne.rendering import FLAT, render
from airborne.rendering.maps import empty_maps, packed_view, surface_maps, workspace
from tests.rendering.bodies import camera, posed_random
from tests.tolerances import SOLVED


def test_surface_maps_are_the_rendering_with_normals_that_point_at_the_camera():
    shapes, posed = posed_random(["ellipsoid", "box", "mesh", "ellipsoid"], 1)
    seen_by = camera(turn=0.7)
    part, inverse_depth, normals = empty_maps(seen_by.size)
    surface_maps(workspace(shapes), shapes, posed.R, posed.t, packed_view(seen_by), part, inverse_depth, normals)
    drawn = render(shapes, posed, seen_by, FLAT)
    assert np.array_equal(part, drawn.part)
    assert np.array_equal(inverse_depth, drawn.inverse_depth)
    v, u = np.nonzero(drawn.mask)
    rays = np.stack([u, v, np.ones_like(u)], axis=1) @ np.linalg.inv(seen_by.K).T
    seen = normals[:, v, u].T
    np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1, rtol=SOLVED)
    assert np.all(np.sum(seen * rays, axis=1) < 1e-3)
