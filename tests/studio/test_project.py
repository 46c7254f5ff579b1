"""The steps' states are computed from the trial's files."""

import json
import shutil

import pytest

from airborne.body.anthropometry import measurements_of
from airborne.errors import TrialError
from airborne.io.folder_lock import sole_writer
from airborne.run.identity import run_identity
from airborne.studio.pages.body import describe_body
from airborne.studio.project import find_trial, list_measurements, list_runs, read_project, steps
from airborne.studio.run_names import check_run_name, next_run_name
from airborne.studio.session import Session
from airborne.trial.file import read_trial
from tests.support.bodies import write_measurements
from tests.support.places import THROWN_CROSS


def states(folder):
    return {step.name: step.state for step in steps(read_project(folder, folder / "trial.toml"))}


def test_a_folder_of_videos_needs_cameras_first(tmp_path):
    assert states(tmp_path) == {
        "Videos": "needs you",
        **dict.fromkeys(["Cameras", "Body", "First pose", "Track", "Review", "Digitise", "Results"], "empty"),
    }


def test_a_prepared_trial_lacks_only_the_run(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    assert states(folder) == {
        **dict.fromkeys(["Videos", "Cameras", "Body", "First pose"], "ready"),
        "Track": "needs you",
        "Review": "empty",
        "Digitise": "empty",
        "Results": "empty",
    }


def test_what_is_missing_is_said(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    (folder / "cam2.mp4").unlink()
    rows = (folder / "control_points.csv").read_text().splitlines()
    (folder / "control_points.csv").write_text("\n".join(rows[:5]))
    said = {step.name: step.says for step in steps(read_project(folder, folder / "trial.toml"))}
    assert said["Videos"] == "cam2.mp4 not found"
    assert said["Cameras"] == "click points in cam1, cam2, cam3"
    assert states(folder)["Track"] == "empty"  # these come first
    (folder / "cross.toml").unlink()
    assert states(folder)["Body"] == "needs you"


def test_a_run_is_ready_once_it_is_finished(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    (run := folder / "results").mkdir()
    (run / "motion.csv").write_text("frame,time_s\n0,0.0\n")

    def track_step():
        step = next(step for step in steps(read_project(folder, folder / "trial.toml")) if step.name == "Track")
        return step.state, step.says

    assert track_step() == ("needs you", "results, not finished")
    with sole_writer(run):
        assert track_step() == ("empty", "results, going on")
    (run / "summary.json").write_text("{}")
    assert track_step() == ("ready", "results")
    (run / "run.json").write_text(json.dumps(run_identity(read_trial(folder / "trial.toml"))))
    assert track_step() == ("ready", "results")
    text = (folder / "trial.toml").read_text()
    (folder / "trial.toml").write_text(
        text.replace('file = "cross.toml"', 'preset = "human18"\nstature_m = 1.7\nmass_kg = 60')
    )
    assert track_step() == (
        "needs you",
        "the body has changed since results was tracked; track again",
    )
    after = {step.name: (step.state, step.says) for step in steps(read_project(folder, folder / "trial.toml"))}
    assert after["Review"] == ("empty", "results (before the change)")
    assert after["Results"] == ("empty", "tables (before the change)")


def test_what_the_steps_say_is_looked_at_again_after_every_change(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    session, stamps = Session(folder, folder / "trial.toml"), set()
    for change in (
        lambda: None,
        lambda: (folder / "cam2.mp4").unlink(),
        lambda: (folder / "results").mkdir(),
        lambda: session.edit("digitised_A_1.csv", "frame\n", "digitised"),
    ):
        change()
        stamps.add(session.stamp)
    assert len(stamps) == 4


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[[camera]]\nname = 3\n", "trial.toml: camera 1: name: expected a valid string"),
        ('[[camera]]\nname = "a"\nvideo = "a.mp4"\nfield = "x"\n', "did you mean fields?"),
        ("camera = 3", "expected [[camera]] tables (found 3)"),
        ("[[camera]\n", "(at line 1, column 9); correct it"),
    ],
)
def test_a_trial_that_cannot_be_read_says_where_and_why(tmp_path, text, says):
    (tmp_path / "trial.toml").write_text(text)
    assert says in (read_project(tmp_path, tmp_path / "trial.toml").mistake or "")


def test_a_video_is_no_folder(tmp_path):
    (tmp_path / "cam1.mp4").write_bytes(b"0")
    with pytest.raises(TrialError, match=r"cam1\.mp4 is a video; give its folder"):
        find_trial(tmp_path / "cam1.mp4")


def test_measurements_of_a_person_are_found_by_what_is_in_the_files(tmp_path):
    write_measurements(tmp_path / "anna.txt", measurements_of(1.7, 60.0))
    (tmp_path / "notes.txt").write_text("filmed on Monday\n")
    assert list_measurements(tmp_path) == ["anna.txt"]


def test_a_path_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(TrialError, match="give a folder of videos"):
        find_trial(tmp_path / "nothing")


def test_a_run_is_one_once_a_frame_is_tracked_and_ticked_once_it_is_finished(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    run = folder / "results"
    run.mkdir()
    (run / "motion.csv").write_text("frame,time_s\n")
    assert (states(folder)["Track"], states(folder)["Review"]) == ("needs you", "empty")
    assert list_runs(folder) == []
    (run / "motion.csv").write_text("frame,time_s\n0,0.0\n")
    assert (states(folder)["Track"], states(folder)["Review"]) == ("needs you", "empty")
    assert list_runs(folder) == [run]
    (run / "summary.json").write_text("{}")
    assert (states(folder)["Track"], states(folder)["Review"]) == ("ready", "ready")


@pytest.mark.parametrize("name", ["", "../x", "a/b", ".airborne", "x" * 81])
def test_a_name_that_no_run_can_have_is_refused_and_not_altered(tmp_path, name):
    with pytest.raises(TrialError, match=r"no slash in it and no dot at its beginning, as results_2"):
        check_run_name(tmp_path, name)


def test_a_run_is_no_file_and_the_next_one_has_a_free_name(tmp_path):
    (tmp_path / "cam1.mp4").write_bytes(b"0")
    with pytest.raises(TrialError, match=r"cam1\.mp4 is a file of this folder; give the run another name, as results"):
        check_run_name(tmp_path, "cam1.mp4")
    assert check_run_name(tmp_path, "results") == tmp_path / "results"
    for name in ("results", "results_2", "throw_b"):
        (tmp_path / name).mkdir()
    assert [next_run_name(tmp_path, name) for name in ("results", "results_2", "throw_b")] == [
        "results_3",
        "results_3",
        "throw_b_2",
    ]


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({}, "No body is chosen yet."),
        ({"file": "cross.toml"}, "The body now: cross.toml"),
        ({"preset": "legs"}, "The body now: players"),
        ({"preset": "human18", "stature_m": 1.74, "mass_kg": 70.0}, "The body now: a person, 1.74 m, 70.0 kg"),
        ({"measurements": "anna.txt"}, "The body now: a person as measured in anna.txt"),
    ],
)
def test_the_body_in_force_is_named(table, says):
    assert describe_body(table) == says
