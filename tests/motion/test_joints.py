"""Landmarks and joint angles over time, with what is known of their errors."""

import csv

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18
from airborne.body.shaping import half_widths_m
from airborne.errors import ResultError
from airborne.geometry.rotations import matrix_from_angles
from airborne.motion import joint_angles, landmarks, write_joint_angles
from airborne.motion.joints import PLACE_SHARE
from tests.support.motions import figure, motion_of, shaken, small_covariance, swinging
from tests.support.tolerances import EXACT, ROUNDTRIP, sampled

MODEL = figure()
TIMES = np.arange(12) / 50


def bent(*angles):
    """Make poses whose first joint has these angles (n, 3) [rad], all others being straight."""
    root = RigidTransform.identity()
    whole = np.zeros((len(angles), len(MODEL.segments) - 1, 3))
    whole[:, 0] = angles
    return [Pose(world_from_root=root, joint_angles=each) for each in whole]


def test_landmark_deviations_are_those_of_sampled_poses():
    rng, covariance = np.random.default_rng(1), small_covariance(MODEL)
    (pose,) = swinging(MODEL, [0.1])
    _, sd = landmarks(motion_of(MODEL, [pose], covariance=covariance), MODEL)
    n = 1500
    points = np.array([MODEL.with_pose(shaken(rng, pose, covariance)).landmarks for _ in range(n)])
    by_pose = np.sqrt(sd[0] ** 2 - (PLACE_SHARE * half_widths_m(MODEL)) ** 2)
    np.testing.assert_allclose(by_pose, np.sqrt(points.var(axis=0).mean(axis=-1)), rtol=sampled(n))


def test_joint_of_a_person_is_known_no_better_than_its_place_between_two_segments():
    model = human18(1.7, 60.0)
    pose = Pose(world_from_root=RigidTransform.identity(), joint_angles=np.zeros((model.n_joints, 3)))
    _, sd = landmarks(motion_of(model, [pose], covariance=np.zeros((model.n_dofs, model.n_dofs))), model)
    sds = dict(zip([mark.name for mark in model.landmarks], sd[0], strict=True))
    shape = dict(zip([segment.name for segment in model.segments], PLACE_SHARE * half_widths_m(model), strict=True))
    assert sds["hip_left"] == pytest.approx((shape["pelvis"] + shape["thigh_left"]) / 2)
    assert sds["hand_left"] == pytest.approx(shape["hand_left"])
    assert sds["wrist_left"] < sds["knee_left"] < sds["hip_left"] < 0.01


def test_unobserved_rotation_affects_only_its_descendants():
    covariance = small_covariance(MODEL)
    arm = 6 + 3 * (MODEL.index_of("arm") - 1)
    covariance[arm] = covariance[:, arm] = 0
    covariance[arm, arm] = np.inf
    _, sd = landmarks(motion_of(MODEL, swinging(MODEL, [0.1]), covariance=covariance), MODEL)
    assert np.isinf(sd[0]).tolist() == [mark.segment in ("arm", "hand") for mark in MODEL.landmarks]


def test_root_alone_known_leaves_the_other_segments_landmarks_unknown():
    _, sd = landmarks(motion_of(MODEL, swinging(MODEL, [0.1]), covariance=np.eye(6)), MODEL)
    assert np.isnan(sd[0]).tolist() == [mark.segment != "trunk" for mark in MODEL.landmarks]


def test_joint_angles_continue_over_full_revolutions_and_lost_frames():
    x = np.linspace(0, 4 * np.pi, 60)
    wrapped = np.stack([np.angle(np.exp(1j * x)), 0.2 * np.sin(x), np.zeros(60)], axis=-1)
    table = joint_angles(motion_of(MODEL, bent(*wrapped), lost=range(20, 24)), MODEL)
    result = table["angle"].sel(joint="head", axis="x").to_numpy()
    assert np.isnan(result[20:24]).all()
    known = np.isfinite(result)
    np.testing.assert_allclose(result[known], np.rad2deg(x)[known], atol=1e3 * ROUNDTRIP)
    assert table["angle"].attrs["units"] == "deg"


def test_angles_that_begin_beyond_half_a_turn_are_brought_back_by_whole_turns():
    """As of arms that are lowered from overhead: 183 to 325 degrees are -177 to -35."""
    x = np.radians(np.linspace(183, 325, 30))
    motion = motion_of(MODEL, bent(*np.stack([x, 0 * x, 0 * x], axis=-1)))
    result = joint_angles(motion, MODEL)["angle"].sel(joint="head", axis="x").to_numpy()
    np.testing.assert_allclose(result, np.rad2deg(x) - 360, atol=1e3 * ROUNDTRIP)


def test_joint_angles_run_on_through_a_right_angle():
    y = np.linspace(1.2, 2.0, 41)
    straight = np.stack([np.full(41, 0.3), y, np.full(41, -0.2)], axis=-1)
    folded = np.where((y > np.pi / 2)[:, None], [0.3 + np.pi, np.pi, -0.2 - np.pi] - straight * [0, 1, 0], straight)
    np.testing.assert_allclose(matrix_from_angles(folded), matrix_from_angles(straight), atol=EXACT)
    table = joint_angles(motion_of(MODEL, bent(*folded), covariance=small_covariance(MODEL)), MODEL)
    result = table.sel(joint="head")
    np.testing.assert_allclose(result["angle"], np.rad2deg(straight), atol=1e3 * ROUNDTRIP)
    is_near = np.abs(np.rad2deg(y) - 90) < 5
    np.testing.assert_array_equal(result["is_singular"], is_near)
    np.testing.assert_array_equal(np.isnan(result["angle_sd"]), np.stack([is_near] * 3, axis=-1) & [True, False, True])


@pytest.mark.parametrize("y", [0.4, 2.5])  # on either branch
def test_joint_angle_deviations_are_those_of_sampled_poses(y):
    rng, covariance, n = np.random.default_rng(2), small_covariance(MODEL), 3000
    (pose,) = bent([-0.7, y, 1.1])
    table = joint_angles(motion_of(MODEL, [pose], covariance=covariance), MODEL)
    drawn = np.array([shaken(rng, pose, covariance).joint_angles for _ in range(n)])
    np.testing.assert_allclose(table["angle_sd"][0], np.rad2deg(drawn.std(axis=0)), rtol=sampled(n))


def test_unobserved_rotation_about_the_long_axis_leaves_the_other_angles_known():
    covariance = small_covariance(MODEL)
    covariance[8] = covariance[:, 8] = 0
    covariance[8, 8] = np.inf
    table = joint_angles(motion_of(MODEL, bent([0.5, 0.3, 0.2]), covariance=covariance), MODEL)
    assert np.isinf(table["angle_sd"].sel(joint="head")[0]).to_numpy().tolist() == [False, False, True]


def test_table_of_joint_angles_is_long_with_empty_cells_where_lost(tmp_path):
    motion = motion_of(MODEL, swinging(MODEL, TIMES), covariance=small_covariance(MODEL), lost=[1])
    write_joint_angles(tmp_path / "joint_angles.csv", motion, MODEL)
    with (tmp_path / "joint_angles.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    columns = "frame,time_s,joint,x_deg,y_deg,z_deg,x_deg_sd,y_deg_sd,z_deg_sd,x_deg_sd_frame,y_deg_sd_frame,"
    columns += "z_deg_sd_frame,is_singular,isb_sequence,"
    columns += "isb_1_deg,isb_2_deg,isb_3_deg,isb_1_deg_sd,isb_2_deg_sd,isb_3_deg_sd,"
    columns += "isb_1_deg_sd_frame,isb_2_deg_sd_frame,isb_3_deg_sd_frame,isb_is_singular"
    assert list(rows[0]) == columns.split(",")
    assert [row["joint"] for row in rows[:5]] == ["head", "arm", "hand", "leg", "head"]
    assert [row["x_deg"] == "" for row in rows[:12]] == [False] * 4 + [True] * 4 + [False] * 4
    assert float(rows[2]["y_deg"]) == pytest.approx(np.rad2deg(motion.joint_angles[0, 2, 1]), abs=ROUNDTRIP)
    assert float(rows[2]["y_deg_sd"]) > 0


def test_motion_of_another_body_is_refused_in_one_line(tmp_path):
    motion = motion_of(figure(), swinging(MODEL, [0.0]))
    other = type(MODEL)("other", MODEL.segments[:3], MODEL.landmarks[:3])
    for refuse in (landmarks, joint_angles):
        with pytest.raises(ResultError, match="body 'other' has head, arm; give the run's body"):
            refuse(motion, other)


def test_body_in_one_piece_has_an_empty_table_of_joint_angles(tmp_path):
    stone = type(MODEL)("stone", MODEL.segments[:1], MODEL.landmarks[:1])
    root = [Pose(world_from_root=pose.world_from_root) for pose in swinging(MODEL, TIMES)]
    write_joint_angles(tmp_path / "joint_angles.csv", motion_of(stone, root), stone)
    assert len((tmp_path / "joint_angles.csv").read_text().splitlines()) == 1
