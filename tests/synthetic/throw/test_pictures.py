"""Pictures show the scene where and when it was."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Ellipsoid, Part, Segment, surface_arrays
from airborne.rendering.srgb import light_from_srgb
from airborne.synthetic import cross_scene, scene_frames
from airborne.synthetic.throw.pictures import background, linear_image, visible_surface
from tests.support.synthetic import small_scene
from tests.support.tolerances import sampled


def dark_room(scene):
    """Return the scene with a body that glows evenly in front of a black background."""
    even = replace(scene.ambient, from_above=np.ones(3), from_below=np.ones(3))
    black = scene.surroundings.with_colours(np.zeros((len(scene.surroundings.parts), 3)))
    return replace(scene, surroundings=black, spots=(), ambient=even)


def centroid(light):
    weights = light[..., 1] / light[..., 1].sum()
    v, u = np.indices(weights.shape)
    return np.array([(weights * u).sum(), (weights * v).sum()])


def posed_at(scene, times):
    flight = scene.flight(np.array(times))
    return [scene.body.with_pose(flight.pose(i)) for i in range(len(times))]


def test_same_scene_gives_the_same_pixels_and_another_seed_does_not():
    scene = small_scene(scale=8, n_pictures=2)
    first, again = (list(scene_frames(scene)) for _ in range(2))
    other = list(scene_frames(replace(scene, seed=4)))
    for a, b, c in zip(first, again, other, strict=True):
        for x, y, z in zip(a.views, b.views, c.views, strict=True):
            np.testing.assert_array_equal(x.rgb, y.rgb)
            assert np.any(x.rgb != z.rgb)


def test_one_camera_alone_sees_what_it_sees_among_others():
    scene = small_scene(scale=8, n_pictures=2)
    alone = replace(scene, rig=scene.rig.select(["cam1"]))
    for all_views, one_view in zip(scene_frames(scene), scene_frames(alone), strict=True):
        np.testing.assert_array_equal(all_views.views[0].rgb, one_view.views[0].rgb)


def test_fields_have_their_own_rows_cameras_and_times():
    scene = small_scene(scale=8, noise_sd=0.0)
    whole = list(scene_frames(replace(scene, is_interlaced=False)))
    fields = list(scene_frames(scene))
    assert [f.time_s * 50 for f in fields] == [0, 1, 2, 3]
    for frame, field in zip(whole, fields, strict=True):
        for full, half, camera in zip(frame.views, field.views, scene.rig, strict=True):
            np.testing.assert_array_equal(half.rgb, full.rgb[field.index % 2 :: 2])
            np.testing.assert_array_equal(half.camera.K, camera.field(field.index % 2).K)
            assert half.camera.size == half.rgb.shape[1::-1]


def test_fields_fill_whole_frames_where_the_truth_covers_an_odd_number():
    assert cross_scene("side-somersault").n_pictures == 39
    assert cross_scene("side-somersault").n_recorded == 40
    assert len(list(scene_frames(small_scene(scale=8, n_pictures=3)))) == 4


def test_body_lies_in_the_image_at_its_finely_rendered_mask():
    scene = dark_room(small_scene(blur_px=0.0))
    camera = scene.rig["cam2"]
    posed = posed_at(scene, [0.1])
    light = linear_image(scene, background(scene, camera), posed)
    n = 10
    fine = camera.resample(
        scale=(1 / n, 1 / n), offset=((1 / n - 1) / 2,) * 2, size=(n * camera.size[0], n * camera.size[1])
    )
    mask = visible_surface(surface_arrays(scene.body), posed[0], fine).mask
    v, u = np.nonzero(mask)
    expected = np.array([u.mean(), v.mean()]) / n + (1 / n - 1) / 2
    np.testing.assert_allclose(centroid(light), expected, atol=0.03)
    yellow = light_from_srgb(scene.body.parts[0].colour)
    np.testing.assert_allclose(light.reshape(-1, 3).sum(axis=0), yellow * mask.sum() / n**2, rtol=0.02)


def test_exposure_is_centred_on_the_time_of_the_image():
    scene = dark_room(small_scene(blur_px=0.0, noise_sd=0.0, exposure_s=0.03, is_interlaced=False, n_pictures=2))
    camera = scene.rig["cam1"]
    short = linear_image(scene, background(scene, camera), posed_at(scene, [0.02]))
    long = light_from_srgb(list(scene_frames(scene))[1].views[0].rgb)
    np.testing.assert_allclose(centroid(long), centroid(short), atol=0.25)
    assert np.count_nonzero(long[..., 1] > 0.02) > 1.3 * np.count_nonzero(short[..., 1] > 0.02)


def test_surface_points_project_to_their_pixels_and_lie_on_the_body():
    scene = small_scene()
    camera, posed = scene.rig["cam3"], posed_at(scene, [0.2])[0]
    observed = visible_surface(surface_arrays(scene.body), posed, camera)
    v, u = np.nonzero(observed.mask)
    np.testing.assert_allclose(camera.px_from_world(observed.points), np.column_stack([u, v]), atol=1e-3)
    in_body = np.abs((observed.points - posed.t[0]) @ posed.R[0])
    assert np.all(np.isclose(in_body[:, 2], 0.0225, atol=1e-5) | (in_body[:, 2] < 0.0225))
    assert np.all(np.einsum("ni,ni->n", observed.normals, observed.points - camera.centre) < 0)


def test_faces_differ_in_brightness_and_some_are_saturated_and_some_dark():
    scene = small_scene("half-twist", scale=2, noise_sd=0.0, n_pictures=34)
    camera = scene.rig["cam1"]
    backdrop = background(scene, camera)
    reds = []
    for i in range(0, 34, 8):
        posed = posed_at(scene, [i / 50])
        mask = visible_surface(surface_arrays(scene.body), posed[0], camera).mask
        reds.append(linear_image(scene, backdrop, posed)[mask][:, 0])
    reds = np.concatenate(reds)
    assert np.mean(reds > 0.96) > 0.02  # 250 of 255
    assert np.mean(reds < 0.35) > 0.05


def test_body_casts_a_shadow_that_moves():
    scene = small_scene()
    camera = scene.rig["cam3"]
    backdrop = background(scene, camera)
    lit = backdrop.ambient + backdrop.spots.sum(axis=0)
    shadows = []
    for time in (0.0, 0.3):
        posed = posed_at(scene, [time])
        light = linear_image(replace(scene, blur_px=0.0), backdrop, posed)
        is_dark = (light < 0.9 * lit).all(axis=-1) & ~visible_surface(surface_arrays(scene.body), posed[0], camera).mask
        shadows.append(is_dark)
    assert all(np.count_nonzero(shadow) > 50 for shadow in shadows)
    assert np.count_nonzero(shadows[0] & shadows[1]) < 0.5 * np.count_nonzero(shadows[0])


def test_noise_has_the_stated_sd():
    scene = small_scene(n_pictures=2, is_interlaced=False, spots=(), noise_sd=6.0)
    quiet = replace(scene, noise_sd=0.0)
    for noisy, clean in zip(scene_frames(scene), scene_frames(quiet), strict=True):
        for a, b in zip(noisy.views, clean.views, strict=True):
            mid = (b.rgb > 40) & (b.rgb < 215)
            error = (a.rgb.astype(float) - b.rgb)[mid]
            assert error.std() == pytest.approx(6.0, rel=sampled(mid.sum() // 3))
            assert abs(error.mean()) < 0.5  # the quiet picture is rounded, evenly lit surfaces all the same way


def test_background_fills_every_camera_of_a_preset():
    scene = small_scene()
    for camera in scene.rig:
        assert background(scene, camera).ambient.min() > 0


def test_surface_points_of_an_ellipsoid_lie_on_it():
    semi_axes = np.array([0.3, 0.2, 0.12])
    part = Part("ball", Ellipsoid(semi_axes), RigidTransform.identity(), None)
    ball = BodyModel("ball", (Segment("ball", None, np.zeros(3), (part,)),))
    scene = small_scene()
    posed = ball.with_pose(scene.flight(np.array([0.1])).pose(0))
    observed = visible_surface(surface_arrays(ball), posed, scene.rig["cam1"])
    inside = (observed.points - posed.t[0]) @ posed.R[0] / semi_axes
    np.testing.assert_allclose(np.linalg.norm(inside, axis=1), 1.0, atol=1e-4)
    facing = np.einsum("ni,ni->n", observed.normals, (inside / semi_axes) @ posed.R[0].T)
    np.testing.assert_allclose(facing, np.linalg.norm(inside / semi_axes, axis=1), rtol=1e-4)


def test_surroundings_that_are_not_there_are_black_and_the_body_is_as_before_others():
    scene = small_scene(scale=2, blur_px=0.0, spots=())
    camera, posed = scene.rig["cam1"], posed_at(scene, [0.1])
    alone = replace(scene, surroundings=None)
    mask = visible_surface(surface_arrays(scene.body), posed[0], camera).mask
    light = linear_image(alone, background(alone, camera), posed)
    inside, outside = (cv2.erode(m.astype(np.uint8), np.ones((3, 3))) > 0 for m in (mask, ~mask))
    assert np.all(light[outside] == 0)
    before = linear_image(scene, background(scene, camera), posed)
    np.testing.assert_allclose(light[inside], before[inside], atol=1e-6)
    assert np.count_nonzero(inside) > 100
