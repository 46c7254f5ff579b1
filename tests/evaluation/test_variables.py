"""What is compared: coordinates in mm, angles on the circle, at common times."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.errors import ResultError
from airborne.evaluation import analyse_agreement
from airborne.evaluation.variables import (
    align_symmetry,
    common_series,
    headline_series,
    individuals_of,
    joint_angle_variables,
    jump_series,
    motion_variables,
    point_variables,
    read_joint_angles,
    root_variables,
)
from tests.support.evaluation import HALF_TURN, flight, motion_of
from tests.support.motions import figure, small_covariance, swinging
from tests.support.motions import motion_of as motion_of_poses

T = np.arange(40) / 50


def root(angle_deg, t=T):
    R = Rotation.from_rotvec(np.deg2rad(angle_deg) * np.tile([1.0, 0.0, 0.0], (len(t), 1))).as_matrix()
    return root_variables(t, np.zeros((len(t), 3)), R)


def by_name(series):
    return {one.name: one for one in series}


def test_angles_differ_on_the_circle_and_not_by_a_revolution():
    result = by_name(common_series([root(179.0), root(-179.0)], "both"))["somersault"]
    assert result.unit == "deg"
    assert result.values[:, 0] - result.values[:, 1] == pytest.approx(np.full(40, -2.0), abs=1e-9)


def test_a_reference_of_several_revolutions_has_their_whole_range():
    steady = np.linspace(10.0, 610.0, 40)[:, None] * np.array([1.0, 0.0, 0.0])
    R = Rotation.from_rotvec(np.deg2rad(steady)).as_matrix()
    turning = root_variables(T, np.zeros((40, 3)), R)
    result = by_name(common_series([turning, turning], "both"))["somersault"]
    assert np.ptp(result.values[:, 1]) == pytest.approx(600.0)
    assert analyse_agreement(result).range == pytest.approx(600.0)
    few = root_variables(T[::10], np.zeros((4, 3)), R[::10])  # steps of 154 degrees: revolutions are those of the run
    result = by_name(common_series([turning, few], "both"))["somersault"]
    assert np.ptp(result.values[:, 1]) == pytest.approx(30 * 600 / 39)


def test_joint_angles_go_on_over_half_a_turn():
    angles = np.zeros((40, 1, 3))
    angles[:, 0, 0] = np.linspace(2.0, 5.0, 40)
    result = joint_angle_variables(T, angles, ["shoulder"]).columns["shoulder turn x", "body"]
    assert np.ptp(result) == pytest.approx(np.rad2deg(3.0))


def test_somersault_and_twist_are_left_out_where_they_are_ambiguous():
    R = Rotation.from_euler("XYZ", np.stack([0 * T, np.linspace(0, np.pi / 2, 40), 0 * T], 1)).as_matrix()
    result = root_variables(T, np.zeros((40, 3)), R)
    assert np.isnan(result.columns["twist", "body"][-1])
    assert np.isfinite(result.columns["tilt", "body"]).all()


def test_only_common_times_and_variables_count():
    one = point_variables(T, np.ones((40, 2, 3)), ["hip", "knee"])
    other = point_variables(T[5:30] + 1e-4, np.zeros((25, 2, 3)), ["knee", "head"])
    third = point_variables(T[10:], np.zeros((30, 1, 3)), ["knee"])
    result = by_name(common_series([one, other, third], "the three"))
    assert set(result) == {"knee x", "knee y", "knee z", "all joints x", "all joints y", "all joints z"}
    assert result["knee x"].values.shape == (20, 3)
    assert result["knee x"].values[:, 0] == pytest.approx(np.full(20, 1000.0))


def test_nothing_in_common_is_reported_plainly():
    with pytest.raises(ResultError, match=r"the runs have no time in common .* give those of one recording"):
        common_series([root(0.0), root(0.0, T + 100)], "the runs")
    with pytest.raises(ResultError, match="no variable in common"):
        common_series([root(0.0), point_variables(T, np.ones((40, 1, 3)), ["hip"])], "the runs")


def test_players_and_joints_are_individuals():
    points = np.random.default_rng(0).normal(size=(40, 2, 3))
    both = point_variables(T, points, ["hip", "knee"], "Anna") | point_variables(T, points, ["hip", "knee"], "Berta")
    result = by_name(common_series([both, both], "both"))
    assert set(result["hip x"].individual) == {"Anna", "Berta"}
    assert len(set(result["all joints z"].individual)) == 4
    assert [one.name for one in headline_series(list(result.values()))] == [f"all joints {axis}" for axis in "xyz"]
    assert [individuals_of(name) for name in ("hip x", "all joints z")] == ["players", "joints"]


def test_a_joint_that_no_image_shows_is_not_compared():
    body, times = figure(), np.arange(6) / 50
    motion = motion_of_poses(body, swinging(body, times), 50, small_covariance(body))
    covariance, mark = np.array(motion.covariance), body.landmarks[-1]
    covariance[2, 3 + 3 * body.index_of(mark.segment), 3 + 3 * body.index_of(mark.segment)] = np.inf
    columns = motion_variables(replace(motion, covariance=covariance), body).columns
    for axis in "xyz":
        assert np.flatnonzero(np.isnan(columns[f"{mark.name} {axis}", "body"])).tolist() == [2]


def test_joint_angles_of_both_branches_are_the_same_rotation():
    angles = np.random.default_rng(1).uniform(-1, 1, (40, 1, 3))
    other = np.stack([angles[..., 0] + np.pi, np.pi - angles[..., 1], angles[..., 2] - np.pi], axis=-1)
    result = common_series(
        [joint_angle_variables(T, angles, ["knee"]), joint_angle_variables(T, other, ["knee"])], "both"
    )
    for one in result:
        assert one.values[:, 0] == pytest.approx(one.values[:, 1], abs=1e-9)


def test_a_symmetric_body_is_aligned_with_the_reference():
    truth = flight()
    motion = motion_of(truth)
    turned = align_symmetry(motion, truth.R @ HALF_TURN[1], truth.time_s, HALF_TURN)
    assert turned == pytest.approx(truth.R @ HALF_TURN[1], abs=1e-9)


def test_joint_angles_are_read_and_a_broken_file_gets_one_line(tmp_path):
    path = tmp_path / "angles.csv"
    path.write_text("frame,time_s,knee_x_rad,knee_y_rad,knee_z_rad\n0,0.0,0.5,0.1,0\n1,0.02,0.6,0.1,\n")
    result = read_joint_angles(path)
    assert result.columns["knee turn x", "body"][0] == pytest.approx(np.rad2deg(0.5))
    assert np.isnan(result.columns["knee turn z", "body"][1])
    path.write_text("time_s,knee_x_rad\n0,1\n")
    with pytest.raises(ResultError, match="no column knee_y_rad"):
        read_joint_angles(path)
    path.write_text("time_s,knee_x_rad,knee_y_rad,knee_z_rad\n1,1,1,1\n0,1,1,1\n")
    with pytest.raises(ResultError, match="must grow"):
        read_joint_angles(path)


def test_jumps_are_compared_in_millimetres_and_milliseconds_and_one_not_found_is_unknown():
    def jump(height_m):
        names = ("foot_height_m", "hip_height_m", "flight_time_height_m", "takeoff_speed_height_m", "hip_rise_m")
        values = dict.fromkeys((*names, "takeoff_s", "landing_s", "flight_s"), SimpleNamespace(value=height_m))
        return SimpleNamespace(player="Anna", number=2, **values)

    series = jump_series([(jump(0.5), jump(0.55)), (jump(0.25), None)])
    assert {one.unit for one in series} == {"mm", "ms"}
    for one in series:
        np.testing.assert_allclose(one.values, [[550, 500], [np.nan, 250]])
        assert one.individual.tolist() == ["Anna jump 2"] * 2
    assert len(headline_series(series)) == len(series)
    assert {individuals_of(one.name) for one in series} == {"jumps"}
