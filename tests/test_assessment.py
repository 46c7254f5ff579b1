"""A finished run is compared with what is known, and its summary keeps the comparison."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from airborne.assessment import assess
from airborne.body.files import read_body
from airborne.errors import ResultError
from airborne.motion import Motion, MotionWriter, write_joints
from tests.motion.helpers import estimate
from tests.players import PLAYERS, write_run, write_truth


@pytest.fixture
def run(tmp_path, thrown_cross):
    """A finished run of three frames, and the paths of its joints 10 mm higher."""
    folder = tmp_path / "run"
    folder.mkdir()
    estimates = [estimate(k) for k in range(3)]
    with MotionWriter(folder / "motion.csv") as writer:
        for item in estimates:
            writer.append(item)
    shutil.copyfile(thrown_cross / "cross.toml", folder / "body.toml")
    (folder / "summary.json").write_text('{"name": "run"}\n')
    motion, body = Motion.collect(estimates), read_body(folder / "body.toml")
    write_joints(tmp_path / "higher.csv", replace(motion, position=motion.position + np.array([0, 0, 0.01])), body)
    return folder


def test_paths_of_joints_are_compared_and_kept_in_the_summary(run):
    found = assess(run, None, None, run.parent / "higher.csv")
    assert list(found) == ["joints"]
    assert found["joints"].whole.mean_mm == pytest.approx(10)
    kept = json.loads((run / "summary.json").read_text())
    assert kept["joints"]["whole"]["bias_mm"] == pytest.approx([0, 0, -10], abs=1e-9)
    assert kept["name"] == "run"


def test_nothing_to_compare_with_is_refused(run):
    with pytest.raises(ResultError, match="or --joints"):
        assess(run, None, None)


def test_a_truth_given_as_joints_is_refused_in_one_line(run, thrown_cross):
    with pytest.raises(ResultError, match="no column joint"):
        assess(run, None, None, thrown_cross / "truth.csv")


def test_players_are_compared_with_their_truth_and_the_summary_keeps_it(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv", off_m=0.03)
    found = assess(run, truth, None)
    assert list(found) == ["truth"]
    assert [errors.parts["all"].mean_mm for errors in found["truth"].players.values()] == pytest.approx([30, 30])
    kept = json.loads((run / "summary.json").read_text())
    assert list(kept["truth"]["players"]) == list(PLAYERS)
    assert kept["name"] == "a block"


def test_a_broken_list_of_jumps_beside_the_truth_is_refused(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv")
    (tmp_path / "players.json").write_text("[")
    with pytest.raises(ResultError, match=r"players\.json"):
        assess(run, truth, None)


def test_players_without_a_summary_are_compared_and_none_is_made(tmp_path):
    run = write_run(tmp_path / "run")
    (run / "summary.json").unlink()
    assert assess(run, write_truth(tmp_path / "truth.csv"), None)["truth"].n_matched == 12
    assert not (run / "summary.json").exists()


def test_players_have_a_truth_only(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv")
    for given in ((None, None, None), (truth, truth, None), (truth, None, truth), (None, None, truth)):
        with pytest.raises(ResultError, match=r"a run of players.*give a truth\.csv"):
            assess(run, *given)


def test_truths_of_players_and_of_a_body_are_told_apart(run, thrown_cross, tmp_path):
    with pytest.raises(ResultError, match="expected a truth table of players"):
        assess(write_run(tmp_path / "players"), thrown_cross / "truth.csv", None)
    with pytest.raises(ResultError, match="no column x_m"):
        assess(run, write_truth(tmp_path / "truth.csv"), None)
