"""The two layers of a drawing against drawings of the body with the segment in front taken away."""

import numpy as np

from airborne.body.surface import surface_arrays
from airborne.rendering.layers import draw_layers
from airborne.rendering.maps import empty_maps, surface_maps
from airborne.rendering.packing import pack_view
from airborne.rendering.shapes import new_shapes
from tests.support.scenes import FIGURE, Scene, standing


def test_second_layer_shows_what_is_behind_the_segment_in_front():
    scene = Scene(FIGURE, standing)
    view = scene.frames(0).views[0]
    assert view is not None
    posed, geometry, packed = FIGURE.with_pose(scene.start()), surface_arrays(FIGURE), pack_view(view.camera)
    width, height = view.camera.size
    part, segment = np.empty((2, height, width), np.int16), np.empty((2, height, width), np.int16)
    normals = np.zeros((2, 3, height, width), np.float32)
    shapes = new_shapes(geometry)
    draw_layers(shapes, geometry, posed.R, posed.t, packed, None, np.float32(0), part, segment, normals)
    whole = empty_maps(view.camera.size)
    surface_maps(shapes, geometry, posed.R, posed.t, packed, *whole)
    np.testing.assert_array_equal(part[0], whole.part)
    assert np.sum(segment[1] >= 0) > 20
    for front in range(len(FIGURE.segments)):
        t = posed.t.copy()
        t[front] -= 1e3 * view.camera.camera_from_world.rotation.as_matrix()[2]
        without = empty_maps(view.camera.size)
        surface_maps(shapes, geometry, posed.R, t, packed, *without)
        own = segment[0] == front
        np.testing.assert_array_equal(part[1][own], without.part[own])
        shown = own & (part[1] >= 0)
        np.testing.assert_allclose(normals[1][:, shown], without.normals[:, shown], atol=1e-5)
