"""Exact pictures are what the tracker itself would draw."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, surface_arrays
from airborne.rendering import Lamp, Lights, render
from airborne.synthetic import scene_frames
from tests.support.synthetic import small_scene
from tests.support.tolerances import sampled

LIGHTS = Lights(0.5, (Lamp(np.array([-3.0, -3.5, 4.2]), 0.45),))


def exact_scene(**changes):
    given = {"lights": LIGHTS, "surroundings": None, "noise_sd": 0.0, "is_interlaced": False, **changes}
    return small_scene(**given)


def render_frame(scene, index, number=0):
    posed = scene.body.with_pose(scene.flight(np.array([float(scene.time_s(index))])).pose(0))
    return render(surface_arrays(scene.body), posed, scene.rig.cameras[number], LIGHTS)


def test_pixels_are_the_rendering_rounded_on_black():
    scene = exact_scene()
    for recorded in scene_frames(scene):
        for number, view in enumerate(recorded.views):
            rendering = render_frame(scene, recorded.index, number)
            assert np.abs(view.rgb - np.clip(rendering.colour, 0, 255)).max() <= 0.5 + 1e-3
            assert np.all(view.rgb[~rendering.mask] == 0)
            assert view.rgb[rendering.mask].max() > 50


def test_surroundings_are_rendered_in_the_same_light_behind_the_body():
    scene = exact_scene(surroundings=small_scene().surroundings)
    black = list(scene_frames(replace(scene, surroundings=None)))
    still = scene.surroundings.with_pose(Pose(world_from_root=RigidTransform.identity()))
    hall = render(surface_arrays(scene.surroundings), still, scene.rig["cam2"], LIGHTS).colour
    for a, b in zip(scene_frames(scene), black, strict=True):
        mask = render_frame(scene, a.index, 1).mask
        np.testing.assert_array_equal(a.views[1].rgb[mask], b.views[1].rgb[mask])
        assert np.abs(a.views[1].rgb[~mask] - np.clip(hall[~mask], 0, 255)).max() <= 0.5 + 1e-3


def test_fields_are_rendered_by_their_own_cameras():
    whole, fields = (list(scene_frames(exact_scene(is_interlaced=is_woven))) for is_woven in (False, True))
    for frame, field in zip(whole, fields, strict=True):
        for full, half in zip(frame.views, field.views, strict=True):
            rows = full.rgb[field.index % 2 :: 2].astype(int)
            assert np.mean(np.abs(rows - half.rgb) > 1) < 1e-3


def test_noise_has_the_stated_sd_is_repeated_and_differs_between_cameras():
    scene = exact_scene(noise_sd=5.0, lights=Lights(0.6), surroundings=small_scene().surroundings)
    noisy, again = (next(iter(scene_frames(scene))) for _ in range(2))
    clean = next(iter(scene_frames(replace(scene, noise_sd=0.0))))
    errors = []
    for a, b, c in zip(noisy.views, again.views, clean.views, strict=True):
        np.testing.assert_array_equal(a.rgb, b.rgb)
        is_mid = (c.rgb > 30) & (c.rgb < 225)
        errors.append((a.rgb.astype(float) - c.rgb)[is_mid])
        assert errors[-1].std() == pytest.approx(np.sqrt(25 + 1 / 12), rel=2 * sampled(is_mid.sum()))
    n = min(map(len, errors))
    assert abs(np.corrcoef(errors[0][:n], errors[1][:n])[0, 1]) < sampled(n)
