"""One key changed in a finished run: only the frames between the keys beside it are tracked again."""

import csv
import json

import numpy as np
import pytest

from airborne.cameras import read_rig
from airborne.errors import ResultError
from airborne.motion.run_folder import read_body_run, videos_of
from airborne.motion.smoothing.settings import Smoothing
from airborne.run.key_misses import far_keys
from airborne.run.smooth import smooth_run
from airborne.run.track import track_trial
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.trial.calibration import CalibrationTable
from airborne.trial.file import Trial, read_trial
from airborne.trial.keys import KeyTable
from airborne.trial.masks import MaskTable

pytestmark = pytest.mark.usefixtures("_plain_figures")

LAST = 13


def key(thrown_cross, frame: int, **changes) -> KeyTable:
    """The digitised pose of a frame, 10 mm beside it."""
    with (thrown_cross / "truth.csv").open() as file:
        row = next(row for row in csv.DictReader(file) if int(row["field"]) == frame)
    place = [round(float(row[axis]) + 0.01, 3) for axis in ("x_m", "y_m", "z_m")]
    return KeyTable(**{"frame": frame, "position_m": place, **changes})


@pytest.fixture(scope="module")
def cross(thrown_cross):
    exact = CalibrationTable(file="calib_true.toml")

    def with_keys(*keys: KeyTable) -> Trial:
        trial = read_trial(thrown_cross / "trial.toml", {"stop": LAST})
        return trial.model_copy(update={"key": list(keys), "calibration": exact})

    return with_keys


@pytest.fixture(scope="module")
def run(cross, thrown_cross, tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys") / "run"
    track_trial(cross(key(thrown_cross, 4), key(thrown_cross, 8)), folder, pictures=False)
    return folder


def poses(folder) -> dict[int, tuple[str, ...]]:
    """The rows of motion.csv without the columns that the self-check of the whole run writes."""
    with (folder / "motion.csv").open() as file:
        rows = list(csv.DictReader(file))
    return {
        int(row["frame"]): tuple(value for name, value in row.items() if not name.endswith("_sd") and name != "status")
        for row in rows
    }


def searched(monkeypatch, views: dict[int, list[bool]] | None = None) -> set[int]:
    """The frames that are searched from now on, and which cameras had an image there."""
    frames: set[int] = set()
    search = RefinedTracker.search

    def noted(self, state, observed):
        index = abs(observed.index)  # it is counted backward in a backward pass
        frames.add(index)
        if views is not None:
            views[index] = [view is not None for view in observed.views]
        return search(self, state, observed)

    monkeypatch.setattr(RefinedTracker, "search", noted)
    return frames


def test_frames_between_the_neighbours_of_a_changed_key_are_tracked_again(
    cross, thrown_cross, run, tmp_path, monkeypatch
):
    before, found = poses(run), searched(monkeypatch)
    assert list(before) == list(range(LAST))
    made = [*smooth_run(run, Smoothing(method="spline")).files, "tables/agreement.csv", "agreement_methods.txt"]
    made += ["report.html", "videos/overlay_cam1.mp4"]
    videos_of(run)
    for name in made[-4:]:
        (run / name).write_text("of before")
    changed = cross(key(thrown_cross, 4, sd_m=0.002), key(thrown_cross, 8))
    summary = track_trial(changed, run, resume=True, pictures=False).summary
    assert found == {1, 2, 3, 4, 5, 6, 7}
    assert [name for name in made if (run / name).exists()] == []
    after = poses(run)
    assert list(after) == list(range(LAST))
    assert all(after[frame] == before[frame] for frame in (0, *range(8, LAST)))
    assert after[4] != before[4]
    assert summary["n_lost"] == 0
    assert [(each["frame"], each["gives"], each["sd_m"]) for each in summary["keys"]] == [
        (4, ["position by hand"], 0.002),
        (8, ["position by hand"], 0.03),
    ]
    found.clear()
    track_trial(changed, run, resume=True, pictures=False)
    assert found == set()
    assert poses(run) == after


def test_a_key_past_the_last_one_touches_what_follows(cross, thrown_cross, run, monkeypatch):
    found = searched(monkeypatch)
    keys = [key(thrown_cross, 4, sd_m=0.002), key(thrown_cross, 8), key(thrown_cross, 11)]
    track_trial(cross(*keys[:2]), run, resume=True, pictures=False)
    found.clear()
    track_trial(cross(*keys), run, resume=True, pictures=False)
    assert found == {9, 10, 11, 12}


def test_a_camera_is_left_out_of_the_frames_of_a_mask_which_are_tracked_again(cross, thrown_cross, run, monkeypatch):
    views: dict[int, list[bool]] = {}
    found = searched(monkeypatch, views)
    keys = [key(thrown_cross, 4, sd_m=0.002), key(thrown_cross, 8), key(thrown_cross, 11)]
    before = poses(run)
    masked = cross(*keys).model_copy(update={"mask": [MaskTable(camera="cam2", first=5, last=6)]})
    summary = track_trial(masked, run, resume=True, pictures=False).summary
    assert found == {5, 6, 7}
    assert summary["masks"] == [{"camera": "cam2", "first": 5, "last": 6}]
    assert views == {5: [True, False, True], 6: [True, False, True], 7: [True, True, True]}
    assert not any("no image" in each for each in summary["events"])  # as it was the mask
    assert all(poses(run)[frame] == before[frame] for frame in (*range(5), *range(8, LAST)))
    found.clear()
    track_trial(cross(*keys), run, resume=True, pictures=False)
    assert found == {5, 6, 7}


def test_a_record_without_keys_is_that_of_a_run_without_keys(cross, tmp_path, monkeypatch):
    trial = cross().model_copy(update={"track": cross().track.model_copy(update={"stop": 2})})
    summary = track_trial(trial, tmp_path / "run", pictures=False).summary
    assert not {"keys", "masks"} & set(summary)
    record = tmp_path / "run" / "run.json"
    written = json.loads(record.read_text())
    assert written.pop("keys") == {"0": "start"}
    record.write_text(json.dumps(written))
    found = searched(monkeypatch)
    track_trial(trial, tmp_path / "run", resume=True, pictures=False)
    assert found == set()


def test_a_key_that_the_pictures_contradict_is_named(cross, thrown_cross, run):
    motion, model = read_body_run(run)
    rig = read_rig(thrown_cross / "calib_true.toml")
    near, far = key(thrown_cross, 4), key(thrown_cross, 8, position_m=[0.5, 0.5, 1.5])
    assert far_keys(cross(near), model, motion, rig) == []
    (said,) = far_keys(cross(near, far), model, motion, rig)
    assert said.startswith("[[key]] of frame 8: the body is ") and "as the pictures say otherwise" in said


def test_another_start_is_another_run(cross, run, thrown_cross):
    trial = cross(key(thrown_cross, 4))
    other = trial.model_copy(update={"start": trial.start.model_copy(update={"position_m": [0.0, 0.0, 1.0]})})
    with pytest.raises(ResultError, match="holds another run"):
        track_trial(other, run, resume=True, pictures=False)


def test_a_key_that_is_not_tracked_is_said_to_be_unused(cross, thrown_cross, tmp_path):
    trial = cross(key(thrown_cross, 5), key(thrown_cross, 30))
    every = trial.model_copy(update={"track": trial.track.model_copy(update={"every": 2, "stop": 3})})
    events = track_trial(every, tmp_path / "run", pictures=False).summary["events"]
    assert any("[[key]] of frame 5, 30 is not used" in event for event in events)


def test_a_frame_that_is_lost_to_a_wrong_key_is_named(cross, thrown_cross, tmp_path):
    trial = cross(KeyTable(frame=2, position_m=[0.0, 0.0, 2.4]))
    short = trial.model_copy(update={"track": trial.track.model_copy(update={"stop": 4})})
    summary = track_trial(short, tmp_path / "run", pictures=False).summary
    assert summary["n_lost"] == 1
    assert any(text.startswith("frame 2 is lost although there is a [[key]] of it") for text in summary["warnings"])


def test_keys_bring_no_harm(run, thrown_cross):
    with (thrown_cross / "truth.csv").open() as file:
        true = {int(row["field"]): [float(row[axis]) for axis in ("x_m", "y_m", "z_m")] for row in csv.DictReader(file)}
    with (run / "motion.csv").open() as file:
        rows = list(csv.DictReader(file))
    off_mm = [
        1e3 * np.linalg.norm(np.array([float(row[axis]) for axis in ("x_m", "y_m", "z_m")]) - true[int(row["frame"])])
        for row in rows
    ]
    assert np.max(off_mm) < 5
