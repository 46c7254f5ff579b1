"""The world's frame: by three points, by a throw; and starts joined."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.world_frame.alignment import (
    estimate_gravity,
    frame_of_gravity,
    frame_of_three_points,
    merge_rigs,
)
from airborne.cameras import Rig
from airborne.errors import CalibrationError
from tests.support import wand_waving as waving
from tests.support.tolerances import EXACT

OLD_FROM_NEW = RigidTransform.from_components([1.0, -2.0, 0.5], Rotation.from_rotvec([0.4, -1.1, 0.7]))
TIMES_S = np.arange(45) / 50


def thrown(rng, *, noise_m=0.005, turn=OLD_FROM_NEW.rotation, scale=1.0):
    flight = np.array([0, 0, 1.0]) + TIMES_S[:, None] * [2, 1, 4.0] + TIMES_S[:, None] ** 2 / 2 * [0, 0, -9.81]
    return scale * turn.apply(flight) + rng.normal(0, noise_m, flight.shape)


def test_three_points_give_back_the_frame_they_were_placed_in():
    corners = OLD_FROM_NEW.apply([[0, 0, 0], [3, 0, 0], [1, 2, 0]])
    found = frame_of_three_points(*corners)
    assert np.abs((found * OLD_FROM_NEW).as_matrix() - np.eye(4)).max() < 10 * EXACT


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([[0, 0, 0], [3, 0, 0], [6, 0.1, 0]], "nearly stand on one line"),
        ([[0, 0, 0], [0.01, 0, 0], [0, 1, 0]], "stand 0.010 m apart"),
        ([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], "was not found"),
    ],
)
def test_points_that_fix_no_frame_are_refused(points, said):
    with pytest.raises(CalibrationError, match=said):
        frame_of_three_points(*np.array(points))


def test_up_is_found_within_its_standard_deviation_and_outliers_do_not_matter():
    rng, up = np.random.default_rng(0), OLD_FROM_NEW.rotation.apply([0, 0, 1.0])
    tilts, sds, magnitudes = [], [], []
    for k in range(40):
        throw = thrown(rng)
        throw[7] += 1.0 * (k % 2)
        throw[20:22] = np.nan
        gravity = estimate_gravity(TIMES_S, [throw])
        tilts.append(np.linalg.norm(np.cross(gravity.up, up)) / np.sqrt(2))  # in one direction
        sds.append(gravity.tilt_sd_rad)
        magnitudes.append((gravity.magnitude - 9.81) / gravity.magnitude_sd)
    assert 0.5 < np.sqrt(np.mean(np.square(tilts))) / np.mean(sds) < 1.2
    assert 0.5 < np.std(magnitudes) < 1.3


def test_two_throws_tell_up_better_than_one():
    rng = np.random.default_rng(1)
    other = Rotation.from_rotvec([0, 0, 2.0])
    throws = [thrown(rng), thrown(rng, turn=OLD_FROM_NEW.rotation * other)]
    both, one = estimate_gravity(TIMES_S, throws), estimate_gravity(TIMES_S, throws[:1])
    assert both.n_throws == 2
    assert both.tilt_sd_rad < one.tilt_sd_rad


def test_the_fall_checks_the_scale():
    rng = np.random.default_rng(2)
    sound, doubled = (estimate_gravity(TIMES_S, [thrown(rng, noise_m=0.002, scale=scale)]) for scale in (1.0, 2.0))
    assert "lengths come out" not in sound.describe()
    assert doubled.magnitude / sound.magnitude == pytest.approx(2.0, rel=5e-3)
    assert re.search(r"lengths come out as (1\.99|2\.00)\d of the truth or times as 0\.70\d of it", doubled.describe())


def test_a_throw_too_short_is_refused():
    with pytest.raises(CalibrationError, match=r"seen for 0\.10 s at most; 0\.29 s and 6 positions are needed"):
        estimate_gravity(TIMES_S[:6], [thrown(np.random.default_rng(3))[:6]])


def test_the_frame_of_gravity_has_z_up_and_x_level():
    gravity = estimate_gravity(TIMES_S, [thrown(np.random.default_rng(4), noise_m=1e-9)])
    corners = OLD_FROM_NEW.apply([[0, 0, 0], [3, 0, 1.0]])
    found = frame_of_gravity(gravity, *corners)
    assert np.abs((found * OLD_FROM_NEW).as_matrix() - np.eye(4)).max() < 1e-6
    with pytest.raises(CalibrationError, match="right above or below"):
        frame_of_gravity(gravity, *OLD_FROM_NEW.apply([[0, 0, 0], [0, 0, 1.0]]))


def transform_rig(rig, new_from_old):
    return Rig(tuple(replace(c, camera_from_world=c.camera_from_world * new_from_old.inv()) for c in rig))


@pytest.mark.parametrize("shared", [["cam2"], ["cam1", "cam2"], ["cam1", "cam2", "cam3"]])
def test_starts_join_through_the_cameras_that_both_hold(shared):
    rig = waving.hall()
    joined = merge_rigs(
        [rig.select(["cam1", "cam2", "cam3"]), transform_rig(rig.select([*shared, "cam4"]), OLD_FROM_NEW)]
    )
    assert set(joined.names) == set(rig.names)
    assert all(np.allclose(joined[name].centre, rig[name].centre) for name in rig.names)


def test_starts_join_one_after_the_other_in_any_order():
    rig = waving.hall()
    parts = [
        rig.select(["cam1", "cam2"]),
        transform_rig(rig.select(["cam3", "cam4"]), OLD_FROM_NEW),
        rig.select(["cam2", "cam3"]),
    ]
    assert all(np.allclose(camera.centre, rig[camera.name].centre) for camera in merge_rigs(parts))


def test_starts_without_a_common_camera_are_refused_by_name():
    rig = waving.hall()
    with pytest.raises(CalibrationError, match="nothing ties cam3, cam4 to cam1, cam2"):
        merge_rigs([rig.select(["cam1", "cam2"]), rig.select(["cam3", "cam4"])])
