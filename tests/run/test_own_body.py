"""A person's own body from a trial: what cannot be fitted is refused in one line."""

import csv
from dataclasses import replace

import cv2
import numpy as np
import pytest

from airborne.body import ATHLETE, human18
from airborne.body.files import read_body
from airborne.body.outfits import Border
from airborne.body_fitting.fit import BodyFit
from airborne.cameras import Rig
from airborne.errors import MistakesError, TrialError
from airborne.export.mosaic import _GAP_PX, _LEFT_PX
from airborne.run.own_body import (
    _CELL_PX,
    _LINE_RGB,
    PersonFit,
    _landmarks_of,
    describe_fit,
    fit_person,
)
from airborne.synthetic.flight.somersault import somersault_scene
from airborne.synthetic.throw.writing import write_trial
from airborne.trial.examples import example_trial
from airborne.trial.file import Trial, read_trial
from airborne.trial.keys import KeyTable
from tests.support.people_seen import four_cameras


@pytest.fixture(scope="module")
def by_hand():
    return read_trial(example_trial("thrown_cross"))


def test_a_start_set_by_hand_does_not_say_where_the_joints_are(by_hand, tmp_path):
    with pytest.raises(TrialError, match="joints_m or points_px under"):
        fit_person(by_hand, tmp_path / "person.toml")
    assert not list(tmp_path.iterdir())


def test_clicks_of_the_start_and_of_keys_say_where_the_joints_are():
    rig, points = four_cameras(), {"hip_left": [0.1, 0.0, 0.9], "shoulder_left": [0.15, 0.0, 1.4]}
    clicks = {name: {c.name: c.px_from_world(np.array(at)).tolist() for c in rig} for name, at in points.items()}
    head = {
        "name": "a jump",
        "camera": [{"name": name, "video": f"{name}.mp4"} for name in rig.names],
        "calibration": {"file": "calib.toml"},
        "body": {"preset": "human18", "stature_m": 1.8, "mass_kg": 75.0},
        "start": {"points_px": clicks},
        "key": [{"frame": 7, "joints_m": points}, {"frame": 9, "position_m": [0, 0, 1]}],
    }
    trial = Trial(**head)
    for forms in (trial.start, trial.key[0]):
        found = _landmarks_of(trial, forms, rig)
        assert all(np.allclose(found[name], at, atol=1e-6) for name, at in points.items())
    assert _landmarks_of(trial, trial.key[1], rig) == {}


def test_a_person_is_fitted_to_the_frames_of_two_keys_and_drawn_over_them(tmp_path):
    whole = somersault_scene("moving-arms", seed=3)
    small = tuple(
        camera.resample(scale=(2, 2), offset=(0.5, 0.5), size=(camera.size[0] // 2, camera.size[1] // 2))
        for camera in whole.rig
    )
    scene = replace(whole, rig=Rig(small), n_pictures=6)
    write_trial(scene, tmp_path / "trial")
    with (tmp_path / "trial" / "truth_joints.csv").open() as file:
        rows = list(csv.DictReader(file))
    keys = [
        KeyTable(
            frame=frame,
            joints_m={
                row["joint"]: [round(float(row[axis]), 3) for axis in ("x_m", "y_m", "z_m")]
                for row in rows
                if int(row["frame"]) == frame
            },
        )
        for frame in (1, 4)
    ]
    trial = read_trial(tmp_path / "trial" / "trial.toml").model_copy(update={"key": keys})
    person = fit_person(trial, tmp_path / "person.toml", n_frames=2)
    assert (person.frames, person.notes) == ((1, 4), ())
    assert person.fit.landmark_rms_m[1] < 0.01
    assert all(0.95 < ratio < 1.05 for ratio in person.fit.lengths.values())
    joints, read = (
        [each.joint_m for each in m.segments] for m in (person.fit.model, read_body(tmp_path / "person.toml"))
    )
    np.testing.assert_allclose(read, joints, atol=1e-6)
    image = cv2.imread(str(person.picture))
    edge, step = _LEFT_PX, _CELL_PX + _GAP_PX  # one line of text is as high as names are wide
    rows, columns = slice(edge, edge + 2 * step), slice(edge, edge + 3 * step)  # of frames, of cameras
    is_line, is_text = (image == _LINE_RGB[::-1]).all(axis=2), (image < 128).all(axis=2)
    cells = is_line[rows, columns].reshape(2, step, 3, step).sum(axis=(1, 3))
    assert (cells > 400).all()  # each cell has the outline
    assert is_text[:edge, columns].reshape(edge, 3, step).any(axis=(0, 2)).all()  # the cameras' names
    assert is_text[rows, :edge].reshape(2, step, edge).any(axis=(1, 2)).all()  # the frames'


def test_exchanged_videos_are_refused_as_where_the_trial_is_tracked(shared_data, tmp_path):
    trial = read_trial(shared_data("somersault_1") / "trial.toml")
    one, two, *others = trial.camera
    exchanged = [one.model_copy(update={"video": two.video}), two.model_copy(update={"video": one.video}), *others]
    with pytest.raises(MistakesError, match="the videos of cam1 and cam2, or their calibrations, are exchanged"):
        fit_person(trial.model_copy(update={"camera": exchanged}), tmp_path / "person.toml")
    assert not list(tmp_path.iterdir())


def test_no_frames_are_refused(by_hand, tmp_path):
    with pytest.raises(TrialError, match="at least 1 frame"):
        fit_person(by_hand, tmp_path / "person.toml", n_frames=0)


def test_the_description_names_lengths_girths_borders_colours_and_residuals(tmp_path):
    body = human18(outfit=ATHLETE)
    fit = BodyFit(
        model=body,
        poses=(),
        start=body,
        start_poses=(),
        lengths={"torso": 1.02, "thigh": 0.95},
        girths={"torso": (1.1, 0.9), "thigh": (1.05, 1.05)},
        joint_widths={"hip": 1.04, "shoulder": 0.97},
        borders={"thigh": Border(0.72, 2)},
        rms_light=(0.04, 0.02),
        landmark_rms_m=(0.015, 0.012),
    )
    person = PersonFit(fit, (0, 50), tmp_path / "fit_body.png", ("cam2 disagrees",))
    lines = describe_fit(person).splitlines()
    assert lines[0] == "fitted to frames 0, 50"
    assert "torso        1.02   1.10 0.90" in lines
    assert "thigh        0.95   1.05" in lines
    assert "distance of left and right joints: hips 1.04, shoulders 0.97" in lines
    assert "colours change along: thigh at 0.72" in lines
    assert any("thigh_shorts 196 32 44" in line for line in lines)
    assert "residual: 10.20 to 5.10 (linear light, 0 to 255)" in lines
    assert "joints: 15 to 12 mm off (RMS)" in lines
    assert lines[-1] == "note: cam2 disagrees"


def test_a_skeleton_without_detections_and_a_folder_that_is_not_there_are_refused(by_hand, tmp_path):
    with pytest.raises(TrialError, match=r"skeleton goes with detections under \[start\]"):
        fit_person(by_hand, tmp_path / "person.toml", skeleton="BODY_25")
    with pytest.raises(TrialError, match="there is no folder"):
        fit_person(by_hand, tmp_path / "none" / "person.toml")
