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
