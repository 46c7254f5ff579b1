"""A calibration that was written to a file says as much of its errors as one that is made for the run."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.from_points import calibrate
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import Rig, write_rig
from airborne.errors import TrialError
from airborne.run.track import track_trial
from airborne.synthetic.throw.writing import write_trial
from airborne.trial.file import read_trial
from tests.support.synthetic import small_scene

SIZE = (192, 144)  # of the scene's pictures


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a short throw, with control points and the file of their calibration."""
    folder = tmp_path_factory.mktemp("calibrated") / "throw"
    write_trial(small_scene(is_interlaced=False), folder)
    rig = calibrated_rig(folder)
    write_rig(folder / "calib.toml", rig)
    silent = (replace(camera, covariance=None, world_sd=None) for camera in rig)
    write_rig(folder / "silent.toml", Rig(tuple(silent)))
    return folder


def calibrated_rig(folder):
    points = read_control_points(folder / "control_points.csv")
    return calibrate(points, dict.fromkeys(points.cameras, SIZE)).rig


def run_with(folder, into, calibration):
    text = (folder / "trial.toml").read_text()
    path = folder / f"{into}.toml"
    path.write_text(text.replace('control_points = "control_points.csv"', calibration))
    return track_trial(read_trial(path), folder / into, pictures=False)


def test_deviations_are_those_of_the_calibration_from_points(folder):
    of_points = run_with(folder, "points", 'control_points = "control_points.csv"')
    of_file = run_with(folder, "file", 'file = "calib.toml"')
    np.testing.assert_allclose(of_file.motion.position, of_points.motion.position, atol=1e-6)
    np.testing.assert_allclose(of_file.motion.position_sd, of_points.motion.position_sd, rtol=0.02)
    assert not any("does not say how good" in text for text in of_file.summary["warnings"])


def test_a_file_that_says_nothing_of_its_errors_takes_what_is_usual_and_says_so(folder):
    usual = run_with(folder, "usual", 'file = "silent.toml"')
    assert any("does not say how good" in text for text in usual.summary["warnings"])


def test_two_cameras_cannot_stand_in_the_same_place(folder):
    rig = calibrated_rig(folder)
    twice = replace(rig["cam1"], name="cam2")
    write_rig(folder / "twice.toml", Rig((rig["cam1"], twice, rig["cam3"])))
    with pytest.raises(TrialError, match=r"cameras cam1 and cam2 have the same place and turn in twice\.toml; each"):
        run_with(folder, "same", 'file = "twice.toml"')
