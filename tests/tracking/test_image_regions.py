"""Regions hold the body and its surroundings, and show what their views show."""

import numpy as np
import pytest

from airborne.body import surface_arrays
from airborne.rendering import FLAT, render
from airborne.tracking.image_regions import bounding_points, crop_regions, narrow_regions
from airborne.video import Frames, View
from tests.support.scenes import CROSS, Scene
from tests.support.tolerances import ROUNDTRIP

SCENE = Scene()
FLAT_CROSS = surface_arrays(CROSS)
MARGIN_PX = 20


def posed_cross(index=0, away=(0.0, 0.0, 0.0)):
    return CROSS.with_pose(SCENE.start(index).move(np.array(away), np.zeros(3)))


def regions(*bodies, frames=None):
    return crop_regions(bodies, FLAT_CROSS, frames or SCENE.frames(0), MARGIN_PX)


def test_region_is_a_crop_whose_camera_sees_the_same_points_at_the_same_pixels():
    points = np.random.default_rng(0).normal([0, 0, 1.4], 0.3, (20, 3))
    for region, view in zip(regions(posed_cross()), SCENE.frames(0).views, strict=True):
        x0, y0 = region.corner
        width, height = region.camera.size
        np.testing.assert_array_equal(region.rgb, view.rgb[y0 : y0 + height, x0 : x0 + width])
        here, there = region.camera.px_from_world(points), view.camera.px_from_world(points)
        np.testing.assert_allclose(here + region.corner, there, atol=ROUNDTRIP)
        assert region.source[0] == view.camera.name


def test_narrowed_region_is_a_crop_of_the_region_that_holds_the_body_and_the_margin():
    body, margin_px = posed_cross(), 12
    wide = regions(posed_cross(0), posed_cross(6))
    for region, narrow in zip(wide, narrow_regions(wide, [body], FLAT_CROSS, margin_px), strict=True):
        assert narrow.rgb.size < region.rgb.size
        np.testing.assert_array_equal(narrow.rgb, narrow.crop(region.view.rgb))
        px, there = (each.camera.px_from_world(bounding_points(body, FLAT_CROSS)) for each in (narrow, region))
        np.testing.assert_allclose(px + narrow.corner, there + region.corner, atol=ROUNDTRIP)
        assert np.all(px.min(axis=0) >= margin_px)
        assert np.all(px.max(axis=0) <= np.array(narrow.camera.size) - 1 - margin_px)


def test_region_that_shows_none_of_the_bodies_stays():
    wide = regions(posed_cross())
    behind = CROSS.with_pose(SCENE.start().move(np.array([0, -30.0, 0]), np.zeros(3)))
    narrowed = narrow_regions(wide[:1], [behind], FLAT_CROSS, 12)
    assert narrowed[0] is wide[0]


def test_region_holds_every_pixel_of_every_body():
    bodies = [posed_cross(0), posed_cross(6), posed_cross(12)]
    for region, view in zip(regions(*bodies), SCENE.frames(0).views, strict=True):
        inside = np.zeros(view.rgb.shape[:2], bool)
        region.crop(inside)[:] = True
        for body in bodies:
            mask = render(FLAT_CROSS, body, view.camera, FLAT).mask
            assert mask.any()
            assert not np.any(mask & ~inside)


def test_region_has_the_margin_and_a_size_in_whole_eights():
    body = posed_cross()
    for region in regions(body):
        px = region.camera.px_from_world(bounding_points(body, FLAT_CROSS))
        size = np.array(region.camera.size)
        assert np.all(px.min(axis=0) >= MARGIN_PX)
        assert np.all(px.max(axis=0) <= size - 1 - MARGIN_PX + 8)
        assert not np.any(size % 8)


def test_hull_of_the_bounding_points_holds_the_body():
    body = posed_cross()
    points = bounding_points(body, FLAT_CROSS)
    local = (points - body.t[0]) @ body.R[0]
    np.testing.assert_allclose(local.min(axis=0), [-0.25, -0.4, -0.04], atol=ROUNDTRIP)
    np.testing.assert_allclose(local.max(axis=0), [0.25, 0.49, 0.1], atol=ROUNDTRIP)


def test_rows_of_a_field_get_half_the_margin():
    frames = SCENE.frames(0)
    view = frames.views[0]
    field = Frames(0, frames.time_s, (View(view.camera.field(1), np.ascontiguousarray(view.rgb[1::2])),))
    (whole,), (half,) = (
        regions(posed_cross(), frames=Frames(0, frames.time_s, (view,))),
        regions(posed_cross(), frames=field),
    )
    assert half.aspect == pytest.approx(whole.aspect / 2)
    assert half.camera.size[0] == whole.camera.size[0]
    assert abs(2 * half.camera.size[1] - whole.camera.size[1]) <= 16


@pytest.mark.parametrize("away", [(30.0, 0, 0), (0, -30.0, 0)], ids=["beside the image", "behind the camera"])
def test_view_that_shows_no_body_is_left_out(away):
    view = SCENE.frames(0).views[0]
    assert regions(posed_cross(away=away), frames=Frames(0, SCENE.frames(0).time_s, (view,))) == []


def test_camera_without_an_image_is_left_out():
    frames = SCENE.frames(0)
    missing = Frames(0, frames.time_s, (None, *frames.views[1:]))
    assert [region.source[0] for region in regions(posed_cross(), frames=missing)] == ["cam1", "cam2", "cam3"]
    assert regions(posed_cross(), frames=Frames(0, frames.time_s, (None,) * 4)) == []


def test_region_of_a_body_at_the_edge_stops_at_the_edge():
    for region, view in zip(regions(posed_cross(away=(-1.0, 0, 0))), SCENE.frames(0).views, strict=True):
        assert np.all(np.array(region.corner) + region.camera.size <= view.camera.size)
        assert min(region.corner) >= 0


def test_crop_is_a_view_that_can_be_written_through():
    region = regions(posed_cross())[0]
    whole = np.zeros(SCENE.frames(0).views[0].rgb.shape[:2])
    region.crop(whole)[:] = 1
    assert whole.sum() == np.prod(region.camera.size)
