"""A run as a value: what its folder holds, as labelled arrays."""

import csv
import json

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.errors import BodyError, ResultError
from airborne.motion import landmarks, measure_flight, measure_jumps
from airborne.motion.jumps.table import JUMP_COLUMNS
from airborne.motion.labelled import label_jumps
from airborne.run import result
from airborne.run.body_tables import write_tables
from airborne.run.result import Run
from tests.support import jumping, players_trial
from tests.support.export_scenes import BOX, PERSON, person_run
from tests.support.export_scenes import run as box_run
from tests.support.motions import motion_of, small_covariance
from tests.support.tolerances import ROUNDTRIP


def run_of(folder, monkeypatch, motion, model):
    """A run of one body whose tables are these."""
    (folder / "motion.csv").touch()
    monkeypatch.setattr(result, "read_body_run", lambda folder: (motion, model))
    return Run(folder)


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(ResultError, match="holds no run"):
        Run(tmp_path)


def test_joints_are_found_by_name_with_units_and_sd(tmp_path, monkeypatch):
    motion = person_run(lost=(4,))
    run = run_of(tmp_path, monkeypatch, motion, PERSON)
    points, sd = landmarks(motion, PERSON)
    column = [landmark.name for landmark in PERSON.landmarks].index("knee_left")
    knee = run.joints.sel(joint="knee_left")
    np.testing.assert_array_equal(knee["position"], points[:, column])
    np.testing.assert_array_equal(knee["position_sd"], sd[:, column])
    assert knee["position"].attrs["units"] == knee["position_sd"].attrs["units"] == "m"
    np.testing.assert_array_equal(run.joints["time"], motion.time_s)
    assert run.joints["status"].sel(time=motion.time_s[4]).item() == "lost"
    assert np.isnan(run.joints["position"][4]).all()


def test_angles_are_those_of_root_and_joints(tmp_path, monkeypatch):
    run = run_of(tmp_path, monkeypatch, person_run(), PERSON)
    assert run.angles["somersault"].attrs["units"] == run.angles["angle"].attrs["units"] == "deg"
    assert run.angles["angle"].sel(joint="forearm_left", axis="x").dims == ("time",)
    assert run.angles["is_singular"].dims == ("time",)
    assert run.angles["joint_is_singular"].dims == ("time", "joint")


def test_flight_needs_masses(tmp_path, monkeypatch):
    assert run_of(tmp_path, monkeypatch, person_run(), PERSON).flight["com"].dims == ("time", "space")
    with pytest.raises(BodyError, match="no mass"):
        _ = run_of(tmp_path, monkeypatch, box_run(), BOX).flight


def test_flight_in_code_has_the_deviations_of_the_table_where_the_frame_rate_is_wrong(tmp_path, monkeypatch):
    turns = [
        RigidTransform.from_components([0, 0, 1 + 2 * t - 9.81 / 2 * t**2], Rotation.from_rotvec([0, 0, 5 * t]))
        for t in np.arange(30) / 50
    ]
    poses = [Pose(world_from_root=turn, joint_angles=np.zeros((len(PERSON.segments) - 1, 3))) for turn in turns]
    motion = motion_of(PERSON, poses, rate_hz=60, covariance=small_covariance(PERSON))
    write_tables(tmp_path, motion, PERSON)
    with (tmp_path / "tables" / "flight.csv").open(newline="") as file:
        table = [float(row["L_z_kg_m2_s_sd"]) for row in csv.DictReader(file)]
    run = run_of(tmp_path, monkeypatch, motion, PERSON)
    stated = run.flight["angular_momentum_sd"].sel(space="z")
    np.testing.assert_allclose(stated, table, rtol=ROUNDTRIP)
    assert (stated > 2 * measure_flight(motion, PERSON)["angular_momentum_sd"].sel(space="z")).all()
    (band,) = run.plot("flight").axes[3].collections
    low, high = (limit(path.vertices[:, 1]) for path in band.get_paths() for limit in (np.min, np.max))
    assert high - low >= 4 * np.max(table)


def test_statuses_of_joints_are_drawn(tmp_path, monkeypatch):
    (axes,) = run_of(tmp_path, monkeypatch, person_run(), PERSON).plot("joint_status").axes
    assert len(axes.get_yticklabels()) == len(PERSON.landmarks)


@pytest.mark.parametrize("what", ["pose", "joints", "flight"])
def test_curves_are_drawn(tmp_path, monkeypatch, what):
    figure = run_of(tmp_path, monkeypatch, person_run(), PERSON).plot(what)
    assert all(axes.lines for axes in figure.axes)


def test_the_text_of_a_run_says_how_far_it_is(tmp_path, monkeypatch):
    run = run_of(tmp_path, monkeypatch, box_run(n=5), BOX)
    assert "not finished, 5 frames; standard deviations without" in repr(run)
    with pytest.raises(ResultError, match=r"its run has not finished; go on with resume=True"):
        _ = run.summary
    counts = {"n_frames": 5, "n_tracked": 4, "n_uncertain": 1, "n_lost": 0}
    (tmp_path / "summary.json").write_text(json.dumps({"name": "a box", **counts}))
    assert repr(run).endswith("a box, 5 frames: 4 tracked, 1 uncertain, 0 lost")
    (tmp_path / "summary.json").write_text("{")
    assert "cannot be read" in repr(run)


@pytest.fixture
def players(tmp_path):
    return Run(players_trial.write_run(tmp_path / "run"))


def test_joints_of_players_have_a_player(players):
    ankle = players.joints.sel(player="Anna", joint="ankle_left")
    assert ankle["position"].dims == ("time", "space")
    np.testing.assert_allclose(ankle["covariance"][0], np.diag([1e-4, 4e-4, 4e-4]))
    np.testing.assert_allclose(ankle["position_sd"] ** 2, 3e-4)
    assert players.rig.names == ("left", "right")
    assert len(players.plot().axes) == 2


def test_a_run_says_what_it_does_not_hold(players, tmp_path, monkeypatch):
    for name in ("motion", "body", "angles", "flight", "root"):
        with pytest.raises(ResultError, match=r"holds a run of players, .*; use \.players"):
            getattr(players, name)
    with pytest.raises(ResultError, match=r"holds a run of one body.*; use \.motion"):
        _ = run_of(tmp_path, monkeypatch, box_run(), BOX).jumps


def test_jumps_are_the_table_with_units(players, monkeypatch):
    motion = jumping.motion_of(jumping.Jumper())
    monkeypatch.setattr(result, "read_players_run", lambda folder: motion)
    (jump,), jumps = measure_jumps(motion), players.jumps
    assert jumps.sizes == {"jump": 1}
    assert set(jumps.data_vars) == set(JUMP_COLUMNS) - {"player", "jump"}
    assert jumps["hip_rise_m"].item() == jump.hip_rise_m.value
    assert jumps["hip_rise_m_low"].item() == jump.hip_rise_m.low
    assert (jumps["player"].item(), jumps["number"].item(), jumps["status"].item()) == ("one", 1, "whole")
    units = {
        name: jumps[name].attrs["units"] for name in ("hip_rise_m_high", "takeoff_speed_m_s", "flight_s", "n_lost")
    }
    assert units == {"hip_rise_m_high": "m", "takeoff_speed_m_s": "m/s", "flight_s": "s", "n_lost": "1"}


def test_without_a_jump_the_table_is_empty():
    jumps = label_jumps(())
    assert jumps.sizes == {"jump": 0}
    assert set(jumps.data_vars) == set(JUMP_COLUMNS) - {"player", "jump"}
