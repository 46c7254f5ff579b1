"""Smooth motions are labelled arrays with units and a history; bodies and players alike."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.errors import ResultError
from airborne.geometry.rotations import geodesic
from airborne.motion import Motion
from airborne.motion.smoothing.settings import Smoothing
from airborne.motion.smoothing.smoother import (
    CENTRE_OF_MASS,
    smooth_joint_angles,
    smooth_landmarks,
    smooth_players,
    smooth_root,
)
from airborne.motion.smoothing.tables import write_smooth_joint_angles, write_smooth_joints
from tests.support.jumping import Jumper
from tests.support.jumping import motion_of as jump_of
from tests.support.motions import figure, motion_of, shaken, small_covariance, swinging

BUTTERWORTH = Smoothing(method="butterworth", cutoff_hz=10)
BODY = figure()
T = np.arange(50) / 50


def swing(sd=3e-3, lost=()):
    rng, covariance = np.random.default_rng(0), small_covariance(BODY, sd)
    poses = swinging(BODY, T)
    true = motion_of(BODY, poses, 50, covariance)
    return true, motion_of(BODY, [shaken(rng, pose, covariance) for pose in poses], 50, covariance, lost=lost)


@pytest.mark.parametrize("smoothing", [BUTTERWORTH, Smoothing(method="kalman")], ids=lambda smoothing: smoothing.method)
def test_a_bodys_root_comes_nearer_to_the_truth_in_position_and_orientation(smoothing):
    true, noisy = swing(sd=0.02)
    result = smooth_root(noisy, BODY, smoothing, [])
    place = result["position"].to_numpy() - true.position
    assert np.std(place) < 0.8 * np.std(noisy.position - true.position)
    R = Rotation.from_quat(result["quaternion"].to_numpy()).as_matrix()
    assert np.mean(geodesic(R, true.R)) < 0.9 * np.mean(geodesic(noisy.R, true.R))


def test_free_fall_is_found_in_the_roots_acceleration():
    _, noisy = swing()
    result = smooth_root(noisy, BODY, Smoothing(method="kalman"), [])
    assert float(result["acceleration"].sel(space="z").mean()) == pytest.approx(-9.81, abs=0.3)


def test_everything_has_its_unit_and_the_history_says_what_was_done():
    _, noisy = swing()
    smoothing = Smoothing(method="butterworth", cutoff_hz=6, fill_s=0.1)
    result = smooth_root(noisy, BODY, smoothing, [0.4])
    units = {name: result[name].attrs.get("units") for name in result if name.startswith(("pos", "vel", "acc", "ang"))}
    assert units["velocity"] == "m/s"
    assert units["angular_acceleration_sd"] == "rad/s2"
    assert None not in units.values()
    history = " ".join(result.attrs["history"])
    assert "Butterworth" in history and "6 Hz" in history and "up to 0.1 s" in history and "0.4000 s" in history
    assert "gaps are not filled" in smooth_root(noisy, BODY, BUTTERWORTH, []).attrs["history"]


def test_landmarks_and_the_centre_of_mass_are_smoothed():
    _, noisy = swing(sd=0.02)
    result = smooth_landmarks(noisy, BODY, BUTTERWORTH, [])
    assert result["joint"].to_numpy().tolist() == [*(mark.name for mark in BODY.landmarks), CENTRE_OF_MASS]
    com = result["acceleration"].sel(joint=CENTRE_OF_MASS, space="z").to_numpy()
    assert np.isfinite(com).all()
    assert np.isfinite(result["position_sd"].to_numpy()).all()


def test_errors_of_the_centre_of_mass_that_last_all_run_are_not_smoothed_away():
    _, noisy = swing(sd=0.02)
    lasting = np.zeros((len(noisy), 6, 6))
    lasting[:, :3, :3] = 0.03**2 * np.eye(3)
    alone, with_lasting = (
        smooth_landmarks(each, BODY, BUTTERWORTH, []).sel(joint=CENTRE_OF_MASS)
        for each in (noisy, replace(noisy, lasting=lasting))
    )
    squares = (each["position_sd"].to_numpy() ** 2 for each in (with_lasting, alone))
    np.testing.assert_allclose(np.subtract(*squares), 0.03**2, rtol=1e-6)
    np.testing.assert_array_equal(with_lasting["velocity_sd"], alone["velocity_sd"])


def test_joints_are_smoothed_as_rotations_and_their_angles_run_on(tmp_path):
    true, noisy = swing(sd=0.05)
    result = smooth_joint_angles(noisy, BODY, BUTTERWORTH, [])
    write_smooth_joint_angles(tmp_path / "angles.csv", result)
    rows = list(csv.DictReader((tmp_path / "angles.csv").read_text().splitlines()))
    assert len(rows) == result["angle"].isel(axis=0).size
    assert float(rows[-1]["z_deg"]) == pytest.approx(float(result["angle"].sel(axis="z")[-1, -1]), abs=1e-4)
    assert {"joint", "wx_deg_s", "sd_deg", "w_sd_deg_s", "is_singular"} <= set(rows[0])
    error = np.deg2rad(result["angle"].to_numpy()) - true.joint_angles
    assert np.std(error) < 0.8 * np.std(noisy.joint_angles - true.joint_angles)
    assert result["velocity"].attrs["units"] == "deg/s"
    with pytest.raises(ResultError, match="give the run's body"):
        smooth_joint_angles(replace(noisy, joints=("a", "b", "c", "d")), BODY, BUTTERWORTH, [])


def test_lost_frames_stay_lost_and_filled_ones_say_so():
    _, noisy = swing(lost=(20, 21))
    assert np.isnan(smooth_root(noisy, BODY, BUTTERWORTH, [])["position"].to_numpy()[20:22]).all()
    filled = smooth_root(noisy, BODY, replace(BUTTERWORTH, fill_s=0.05), [])
    assert np.flatnonzero(filled["is_filled"].to_numpy()).tolist() == [20, 21]
    assert np.isfinite(filled["position"].to_numpy()).all()
    assert filled["status"].to_numpy()[20] == "lost"


def test_a_joint_that_no_image_shows_is_a_gap_and_each_row_says_how_it_was_tracked(tmp_path):
    _, noisy = swing(lost=(40,))
    covariance, shank = np.array(noisy.covariance), BODY.index_of(BODY.landmarks[-1].segment)
    covariance[20:22, 3 + 3 * shank, 3 + 3 * shank] = np.inf  # it may turn as it likes
    result = smooth_landmarks(replace(noisy, covariance=covariance), BODY, BUTTERWORTH, [])
    last = result.sel(joint=BODY.landmarks[-1].name)
    assert np.flatnonzero(np.isnan(last["position"].to_numpy()).any(axis=1)).tolist() == [20, 21, 40]
    assert last["joint_status"].to_numpy()[[19, 20, 21, 40]].tolist() == ["tracked", "unknown", "unknown", "lost"]
    com = result.sel(joint=CENTRE_OF_MASS)
    assert com["joint_status"].to_numpy()[[20, 40]].tolist() == ["tracked", "lost"]
    write_smooth_joints(tmp_path / "joints.csv", result)
    rows = list(csv.DictReader((tmp_path / "joints.csv").read_text().splitlines()))
    assert [row["status"] for row in rows] == result["joint_status"].to_numpy().ravel().tolist()


def test_each_player_has_own_segments():
    jumper = Jumper()
    motion = jump_of(jumper)
    motion = replace(
        motion,
        players=("one", "two"),
        points=np.repeat(motion.points, 2, axis=1),
        covariance=np.repeat(motion.covariance, 2, axis=1),
        joint_status=np.repeat(motion.joint_status, 2, axis=1),
    )
    result = smooth_players(motion, BUTTERWORTH, {"one": [jumper.takeoff_s, jumper.landing_s], "two": []})
    assert result["segment"].sel(player="one").max() == 2
    assert result["segment"].sel(player="two").max() == 0
    inside = (motion.time_s > jumper.takeoff_s) & (motion.time_s < jumper.landing_s)
    bend = result["acceleration"].sel(space="z", joint="hip_left").to_numpy()[inside]
    assert bend[:, 0] == pytest.approx(np.full(inside.sum(), -9.81), abs=0.02)
    assert np.abs(bend[:, 1] + 9.81).max() > 5


def test_the_kalman_smoother_needs_covariances():
    _, noisy = swing()
    blind = replace(noisy, covariance=np.full_like(noisy.covariance, np.nan))
    with pytest.raises(ResultError, match="states no covariances"):
        smooth_root(blind, BODY, Smoothing(method="kalman"), [])
    assert np.isnan(smooth_root(blind, BODY, BUTTERWORTH, [])["position_sd"].to_numpy()).all()


@pytest.mark.parametrize("n", [0, 1, 3])
def test_hardly_any_frame_gives_no_numbers_and_no_error(n):
    _, noisy = swing()
    estimates = Motion.collect([], noisy.joints)
    rows = {name: rows[:n] for name in estimates.__slots__ if isinstance(rows := getattr(noisy, name), np.ndarray)}
    few = replace(estimates, **rows)
    result = smooth_root(few, BODY, BUTTERWORTH, [])
    assert result.sizes["time"] == n
    assert np.isnan(result["position"].to_numpy()).all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"method": "spline", "fill_s": 0.6}, "0 to 0.5 s"),
        ({"method": "spline", "fill_s": float("nan")}, "0 to 0.5 s"),
        ({"method": "spline", "resample_hz": 60}, "leave them out of spline"),
        ({"method": "kalman", "cutoff_hz": 6}, "leave them out of kalman"),
    ],
)
def test_what_makes_no_sense_is_refused(wrong, message):
    with pytest.raises(ResultError, match=message):
        Smoothing(**wrong)
    with pytest.raises(ResultError, match="needs a cut-off"):
        Smoothing(method="butterworth").smoother(has_joints=True)
