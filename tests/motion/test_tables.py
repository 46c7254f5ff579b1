"""The tables of a run."""

import csv
import re
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Part, Pose, Segment
from airborne.body.shaping import half_widths_m
from airborne.geometry.rotations import angles_from_matrix
from airborne.motion import (
    Motion,
    measure_flight,
    root_angles,
    write_angles,
    write_flight,
    write_joint_angles,
    write_joints,
    write_motion_parquet,
)
from airborne.motion.joints import PLACE_SHARE
from airborne.tracking import Status
from tests.support.motions import estimate, figure, motion_of, run_with_gap, somersault, swinging
from tests.support.places import ROOT
from tests.support.tolerances import EXACT, ROUNDTRIP, sampled


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def jointed_body():
    part = Part("part", Box(np.ones(3)), RigidTransform.identity(), None)
    trunk = Segment("trunk", None, np.zeros(3), (part,))
    return BodyModel("body", (trunk, Segment("head", "trunk", np.array([0.0, 0, 0.6]), ())))


def test_angles_of_a_steady_somersault_continue_past_half_a_revolution():
    estimates, truth = somersault(turns=2.0)
    angles = root_angles(Motion.collect(estimates))
    np.testing.assert_allclose(angles.deg, np.rad2deg(truth), atol=1e3 * ROUNDTRIP)


def test_angles_run_on_over_lost_frames():
    estimates, truth = somersault()
    for i in range(10, 16):
        estimates[i] = replace(estimates[i], status=Status.LOST, pose=None, covariance=None)
    angles = root_angles(Motion.collect(estimates))
    assert np.isnan(angles.deg[10:16]).all()
    np.testing.assert_allclose(angles.deg[16:], np.rad2deg(truth[16:]), atol=1e3 * ROUNDTRIP)


def test_angle_deviations_are_those_of_sampled_rotations():
    item = estimate(2)
    covariance = item.covariance * 1e-3
    angles = root_angles(Motion.collect([replace(item, covariance=covariance)]))
    n = 20000
    vectors = np.random.default_rng(0).multivariate_normal(np.zeros(3), covariance[3:, 3:], size=n)
    R = item.pose.world_from_root.rotation.as_matrix()
    sampled_angles = angles_from_matrix(Rotation.from_rotvec(vectors).as_matrix() @ R)
    np.testing.assert_allclose(angles.sd_deg[0], np.rad2deg(sampled_angles.std(axis=0)), rtol=sampled(n))


def test_angle_deviations_are_unknown_where_the_covariance_is_infinite_or_missing():
    blind = estimate(0)
    blind.covariance[4, 4] = np.inf
    angles = root_angles(Motion.collect([blind, estimate(1, covariance=False), estimate(2)]))
    assert np.isnan(angles.sd_deg).all(axis=1).tolist() == [True, True, False]


def test_angles_near_ninety_degrees_of_tilt_carry_a_sign_and_no_deviation(tmp_path):
    tilted = Rotation.from_euler("XYZ", [20, 88, 40], degrees=True)
    item = replace(estimate(0), pose=Pose(world_from_root=RigidTransform.from_components(np.zeros(3), tilted)))
    write_angles(tmp_path / "angles.csv", Motion.collect([item]))
    (row,) = rows_of(tmp_path / "angles.csv")
    assert row["is_singular"] == "1"
    assert row["twist_deg_sd"] == ""
    assert float(row["tilt_deg"]) == pytest.approx(88, abs=ROUNDTRIP)


def test_angles_table_has_empty_cells_where_lost(tmp_path):
    write_angles(tmp_path / "angles.csv", Motion.collect(run_with_gap(4, lost=[2])))
    rows = rows_of(tmp_path / "angles.csv")
    columns = "frame,time_s,somersault_deg,tilt_deg,twist_deg,somersault_deg_sd,tilt_deg_sd,twist_deg_sd,is_singular"
    assert list(rows[0]) == columns.split(",")
    assert [row["tilt_deg"] == "" for row in rows] == [False, False, True, False]


@pytest.mark.parametrize("n", [0, 1, 5])
def test_parquet_holds_the_motion_with_units(tmp_path, n):
    motion = Motion.collect(run_with_gap(n, lost=[3], n_joints=1), ("head",))
    write_motion_parquet(tmp_path / "motion.parquet", motion)
    table = pq.read_table(tmp_path / "motion.parquet")
    units = {field.name: field.metadata[b"units"].decode() for field in table.schema}
    assert (units["x_m"], units["rx_deg_sd"], units["time_s"], units["x_m_sd"]) == ("m", "deg", "s", "m")
    assert (units["qw"], units["score"], units["head_x_deg"]) == ("1", "grey levels", "deg")
    assert table["x_m"].null_count == (n > 3)
    known = table["z_m"].to_numpy()[motion.has_pose]
    np.testing.assert_array_equal(known, motion.position[motion.has_pose, 2])


def test_joints_are_the_segments_origins(tmp_path):
    motion = Motion.collect(run_with_gap(3, lost=[1], n_joints=1), ("head",))
    write_joints(tmp_path / "joints.csv", motion, jointed_body())
    rows = rows_of(tmp_path / "joints.csv")
    assert [(row["frame"], row["joint"]) for row in rows] == [(str(f), j) for f in range(3) for j in ("trunk", "head")]
    assert all(row[column] == "" for row in rows[2:4] for column in ("x_m", "y_m", "z_m", "sd_m"))
    head = [float(rows[1][column]) for column in ("x_m", "y_m", "z_m")]
    np.testing.assert_allclose(head, motion.position[0] + motion.R[0] @ [0, 0, 0.6], atol=EXACT)


def test_joint_deviation_grows_with_the_distance_from_the_root(tmp_path):
    estimates, _ = somersault(2, variance=(1e-6, 1e-4))
    write_joints(tmp_path / "joints.csv", Motion.collect(estimates, ("head",)), jointed_body())
    trunk, head = rows_of(tmp_path / "joints.csv")[:2]
    own, of_head = PLACE_SHARE * half_widths_m(jointed_body())  # where a joint lies in its segments
    assert float(trunk["sd_m"]) == pytest.approx(np.hypot(1e-3, own), rel=ROUNDTRIP)
    # two of the three axes move with the rotation: per-axis variance 1e-6 + 2/3 * 0.6^2 * 1e-4
    expected = np.sqrt(1e-6 + 2 / 3 * 0.36 * 1e-4 + ((own + of_head) / 2) ** 2)
    assert float(head["sd_m"]) == pytest.approx(expected, rel=ROUNDTRIP)


def test_joint_deviation_is_that_of_sampled_poses(tmp_path):
    item = estimate(0, n_joints=1)
    covariance = item.covariance * 1e-3
    write_joints(
        tmp_path / "joints.csv", Motion.collect([replace(item, covariance=covariance)], ("head",)), jointed_body()
    )
    n = 20000
    moves = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance[:6, :6], size=n)
    offset = item.pose.world_from_root.rotation.apply([0, 0, 0.6])
    heads = moves[:, :3] + Rotation.from_rotvec(moves[:, 3:6]).apply(offset)
    expected = np.sqrt(heads.var(axis=0).mean() + (PLACE_SHARE * half_widths_m(jointed_body()).mean()) ** 2)
    assert float(rows_of(tmp_path / "joints.csv")[1]["sd_m"]) == pytest.approx(expected, rel=sampled(n))


@pytest.mark.parametrize("name", ["joint_angles.csv", "flight.csv"])
def test_columns_of_a_jointed_body_are_documented(tmp_path, name):
    model = figure()
    motion = motion_of(model, swinging(model, [0.0, 0.02]))
    if name == "flight.csv":
        write_flight(tmp_path / name, motion, measure_flight(motion, model))
    else:
        write_joint_angles(tmp_path / name, motion, model)
    page = (ROOT / "docs" / "reference" / "results.md").read_text(encoding="utf-8")
    table = re.search(rf"^## `{re.escape(name)}`\n\n((?:\|.*\n)+)", page, re.MULTILINE)[1]
    documented = [column for line in table.splitlines()[2:] for column in re.findall(r"`(\w+)`", line.split("|")[1])]
    assert (tmp_path / name).read_text().splitlines()[0].split(",") == documented


def test_unobserved_rotation_leaves_the_roots_own_deviation_finite(tmp_path):
    item = estimate(0)
    item.covariance[3:] = item.covariance[:, 3:] = np.nan
    item.covariance[3, 3] = np.inf
    write_joints(tmp_path / "joints.csv", Motion.collect([item], ("head",)), jointed_body())
    trunk, head = rows_of(tmp_path / "joints.csv")
    assert float(trunk["sd_m"]) > 0
    assert head["sd_m"] == ""
