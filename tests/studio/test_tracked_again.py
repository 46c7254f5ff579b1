"""What the page says once a run is tracked again; where a body that is lost is drawn to be grabbed."""

import json
from fractions import Fraction

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at
from airborne.motion import MotionWriter, read_motion
from airborne.motion.files import read_estimates
from airborne.motion.rows import read_rows
from airborne.studio.ghosts import ghost_of
from airborne.studio.runs import describe_progress
from airborne.studio.tracked_again import RunBefore, describe_pending, describe_tracked_again, name_frames
from airborne.tracking.estimate import lost_estimate
from airborne.trial.file import read_trial
from tests.support.person_run import PERSON, PERSON_TABLE, write_person_run

N, RATE, KEY, OFF_PX = 12, Fraction(50), 5, 3.0
CAMERA = camera_looking_at("a", [3.0, -4.0, 1.5], [0, 0, 1.1], focal_px=300, size=(320, 240))
TRIAL = f"""name = "person"
calibration = {{ file = "results/calib.toml" }}
start = {{ frame = 0, position_m = [0, 0, 1], quaternion_xyzw = [0, 0, 0, 1] }}
{PERSON_TABLE}
camera = [{{ name = "a", video = "a.mp4" }}]
"""


def change_rows(run, changes):
    """Give some frames of a run another estimate: frame -> a function of that which it has."""
    path = run / "motion.csv"
    estimates, joints = read_estimates(path), read_motion(path).joints
    path.unlink()
    with MotionWriter(path, joints) as writer:
        for each in estimates:
            writer.append(changes.get(each.index, lambda same: same)(each))


def lose(estimate):
    return lost_estimate(estimate.index, estimate.time_s)


@pytest.fixture
def run(tmp_path):
    """A run of a person, before a key at one frame: a click beside the left knee."""
    run = tmp_path / "results"
    write_person_run(run, Rig((CAMERA,)), N, RATE)
    (run / "run.json").write_text(json.dumps({"keys": {"0": "start", "9": "same"}, "masks": []}))
    return run


def track_again(run, keys, changes=None):
    """Let a run be tracked again; return what is said of it."""
    before = RunBefore.of(run)
    assert not before.is_changed(run)
    (run / "run.json").write_text(json.dumps({"keys": {"0": "start", "9": "same"} | keys, "masks": []}))
    change_rows(run, changes or {})
    knee = [mark.name for mark in PERSON.landmarks].index("knee_left")
    pose = read_rows(run / "motion.csv").pose(KEY if changes is None else 0)
    u, v = CAMERA.px_from_world(PERSON.with_pose(pose).landmarks[knee])
    trial = run.parent / "trial.toml"
    trial.write_text(
        f"{TRIAL}[[key]]\nframe = 9\nposition_m = [0, 0, 1]\n"
        f"[[key]]\nframe = {KEY}\npoints_px = {{ knee_left = {{ a = [{u + OFF_PX}, {v}] }} }}\n"
    )
    return describe_tracked_again(before, run, read_trial(trial))


def test_it_says_how_near_the_body_came_to_a_click(run):
    said = track_again(run, {str(KEY): "new"})
    assert said.startswith("frames 1 to 8 tracked again; at frame 5 the left knee is 3.0 px from its click in a (0.")
    assert said.endswith(" sd)")


def test_it_says_what_is_lost_and_what_to_do(run):
    said = track_again(run, {str(KEY): "new"}, {KEY: lose, 7: lose, 11: lose})
    assert said.startswith(
        "frames 1 to 8 tracked again; frame 5 is now lost: the pictures show no body near its key; undo"
    )
    assert said.endswith("; frame 7 is lost")


def test_it_says_where_nothing_was_tracked_again(run):
    assert track_again(run, {}) == "no frame was tracked again: the corrections touch none of frames 0 to 11"


def test_a_run_lacks_the_corrections_that_its_trial_got_since(run):
    record, trial = run / "run.json", run.parent / "trial.toml"
    trial.write_text(TRIAL)
    record.write_text(json.dumps({"keys": {"0": "start"}, "masks": []}))
    assert describe_pending(read_trial(trial), run) == ""
    trial.write_text(
        f'{TRIAL}[[key]]\nframe = 9\nposition_m = [0, 0, 1]\n[[mask]]\ncamera = "a"\nfirst = 3\nlast = 4\n'
    )
    assert describe_pending(read_trial(trial), run) == (
        "Not tracked yet: frame 9; a left out of 3 to 4. Tracking again goes over frames 1 to 11."
    )
    record.write_text(json.dumps({"keys": {"0": "start", "5": "x"}, "masks": [{"camera": "a", "first": 3, "last": 3}]}))
    trial.write_text(TRIAL)
    assert describe_pending(read_trial(trial), run) == (
        "Not tracked yet: frame 5, no longer corrected; a used again in 3. Tracking again goes over frames 1 to 11."
    )
    record.write_text(json.dumps({"keys": {"2": "start"}, "masks": []}))
    trial.write_text("\n".join(line for line in TRIAL.splitlines() if not line.startswith("start")))
    assert describe_pending(read_trial(trial), run) == ""  # where it began was found
    record.unlink()
    assert describe_pending(read_trial(trial), run) == ""


def test_frames_are_named_by_stretches():
    assert name_frames(np.array([3])) == "frame 3"
    assert name_frames(np.array([1, 2, 3, 5, 8, 9])) == "frames 1 to 3, 5 and 8 to 9"
    assert name_frames(np.array([0, 2, 4, 8]), step=2) == "frames 0 to 4 and 8"


def test_a_lost_body_is_drawn_between_the_frames_around_it_or_as_it_goes_on(run):
    truth = {frame: read_rows(run / "motion.csv").pose(frame).world_from_root.translation for frame in (4, 11)}
    change_rows(run, {4: lose, 5: lose, 10: lose, 11: lose})
    rows = read_rows(run / "motion.csv")
    for frame, where in ((4, "between frames 3 and 6"), (11, "as it goes on from frames 8 and 9")):
        pose, said = ghost_of(rows, frame)
        assert said == where
        np.testing.assert_allclose(pose.world_from_root.translation, truth[frame], atol=1e-9)
    change_rows(run, {frame: lose for frame in range(1, N)})
    assert ghost_of(read_rows(run / "motion.csv"), 7)[1] == "where frame 0 has it"
    change_rows(run, {0: lose})
    assert ghost_of(read_rows(run / "motion.csv"), 7) is None


def test_a_run_that_goes_on_says_how_far_it_is_and_that_its_report_is_written():
    assert describe_progress(0, 34) == "opening videos"
    assert describe_progress(12, 34) == "12 of 34 frames"
    assert describe_progress(34, 34) == "34 frames tracked, writing tables and report"
