"""The presets are the paper's throws."""

import numpy as np
import pytest

from airborne.body import surface_arrays
from airborne.errors import TrialError
from airborne.synthetic import cross_scene
from airborne.synthetic.flight.rigid import mass_properties
from airborne.synthetic.throw.measurements import control_points, digitise, start_pose
from tests.support.tolerances import EXACT

PRESETS = ("side-somersault", "half-twist")


def fly_scene(scene):
    return scene.flight(np.arange(scene.n_pictures) / 50)


def share_along_momentum(scene, axis):
    """Return the cosine between a body axis and the angular momentum at the first and the last field."""
    mass, flight = mass_properties(scene.body, scene.flight.density_kg_m3), fly_scene(scene)
    momentum = flight.R[0] @ mass.inertia @ flight.angular_velocity[0]
    return flight.R[[0, -1], :, axis] @ momentum / np.linalg.norm(momentum)


@pytest.mark.parametrize("seed", range(5))
def test_half_twist_flips_the_short_bar(seed):
    start, end = share_along_momentum(cross_scene("half-twist", seed=seed), axis=0)
    assert start > 0.95
    assert end < -0.95


@pytest.mark.parametrize("seed", range(5))
def test_side_somersault_keeps_the_plane_of_the_bars_and_rotates_once(seed):
    scene = cross_scene("side-somersault", seed=seed)
    start, end = share_along_momentum(scene, axis=2)
    assert start < -0.97
    assert end < -0.97
    turned = np.linalg.norm(fly_scene(scene).angular_velocity, axis=1).mean() * 38 / 50
    assert np.degrees(turned) == pytest.approx(360, abs=30)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("seed", range(3))
def test_body_stays_in_every_image_above_the_floor_and_before_the_clutter(preset, seed):
    scene = cross_scene(preset, seed=seed)
    flight, corners = fly_scene(scene), surface_arrays(scene.body).corners
    world = np.einsum("nij,cj->nci", flight.R, corners) + flight.position[:, None]
    for camera in scene.rig:
        px = camera.px_from_world(world)
        assert px.min() > 20
        assert np.all(px < np.array(camera.size) - 21)
    assert world[..., 2].min() > 0.3
    assert world[..., 1].max() < 1.6


def test_fields_and_rate_are_those_of_the_paper():
    assert [cross_scene(preset).n_pictures for preset in PRESETS] == [39, 34]
    assert cross_scene().time_s(1) * 50 == 1


def test_seed_varies_the_throw_and_the_background():
    one, two = cross_scene(seed=1), cross_scene(seed=2)
    assert np.abs(one.flight.launch.angular_velocity - two.flight.launch.angular_velocity).max() > 1e-3
    assert np.abs(surface_arrays(one.surroundings).corners - surface_arrays(two.surroundings).corners).max() > 0.1


def test_start_is_off_by_what_the_scene_states():
    scene = cross_scene(seed=7)
    start, true = start_pose(scene).world_from_root, fly_scene(scene).pose(0).world_from_root
    assert np.linalg.norm(start.translation - true.translation) == pytest.approx(scene.start_error_m, rel=1e-9)
    assert (start.rotation * true.rotation.inv()).magnitude() == pytest.approx(scene.start_error_rad, rel=1e-9)


def test_clicks_scatter_about_their_points():
    scene = cross_scene(seed=2)
    points = control_points(scene)
    px = np.stack([camera.px_from_world(points.world) for camera in scene.rig], axis=1)
    error = (points.px - px)[np.isfinite(points.px)]
    assert len(error) > 110
    assert error.std() == pytest.approx(0.5, rel=0.2)
    flight = fly_scene(scene)
    ends = digitise(scene, flight)
    assert list(ends) == ["long_minus", "long_plus", "short_minus", "short_plus"]
    world = flight.R @ np.array([0.3, 0.18, 0]) + flight.position
    px = np.stack([camera.px_from_world(world) for camera in scene.rig], axis=1)
    assert (ends["short_plus"] - px).std() == pytest.approx(1.2, rel=0.2)


def test_control_points_surround_the_flight():
    world = control_points(cross_scene()).world
    assert world.shape == (24, 3)
    np.testing.assert_allclose(np.ptp(world, axis=0), [2.0, 1.4, 2.2], atol=0.1)
    np.testing.assert_allclose(world, np.round(world, 4), atol=EXACT)


def test_unknown_preset_is_refused_with_those_there_are():
    with pytest.raises(TrialError, match="'salto' is not known; choose side-somersault or half-twist"):
        cross_scene("salto")  # pyright: ignore[reportArgumentType]
