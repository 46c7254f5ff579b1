"""A start in the middle of a recording: the frames before it are tracked from there back."""

import csv
import json

import av
import numpy as np
import pytest

from airborne.errors import ResultError, TrialError
from airborne.motion.run_folder import RUN_RECORD
from airborne.run.check import check_trial
from airborne.run.track import track_trial
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.trial.calibration import CalibrationTable
from airborne.trial.file import Trial, read_trial
from airborne.trial.masks import MaskTable
from airborne.trial.settings import BodySettings
from airborne.trial.start import StartTable
from tests.support.example_trial import CALIBRATED, edit_trial

MIDDLE, STOP = 6, 10
NEXT = MIDDLE - 2  # the frame before the start, where every second one is tracked


@pytest.fixture(scope="module")
def digitised(thrown_cross) -> dict[int, dict[str, float]]:
    with (thrown_cross / "truth.csv").open() as file:
        return {int(row["field"]): {name: float(value) for name, value in row.items()} for row in csv.DictReader(file)}


@pytest.fixture(scope="module")
def middle(thrown_cross, digitised):
    """The example from its frame 6 on, and back to a first frame."""
    row = digitised[MIDDLE]
    rotation = [[row[f"r{i}{j}"] for j in range(3)] for i in range(3)]
    place = [row["x_m"] + 0.02, row["y_m"], row["z_m"]]

    def starting(first: int | None, **track) -> Trial:
        trial = read_trial(thrown_cross / "trial.toml")
        settings = BodySettings(start=first, stop=STOP, **track)
        start = StartTable(frame=MIDDLE, position_m=place, rotation_matrix=rotation)
        exact = CalibrationTable(file="calib_true.toml")
        return trial.model_copy(update={"calibration": exact, "start": start, "track": settings})

    return starting


@pytest.fixture(scope="module")
def run(middle, tmp_path_factory):
    folder = tmp_path_factory.mktemp("middle") / "run"
    return folder, track_trial(middle(0), folder)


def levels(path) -> np.ndarray:
    """The mean level of a video's frames in 8 × 8 patches."""
    with av.open(str(path)) as container:
        images = [frame.to_ndarray(format="gray").astype(float) for frame in container.decode(video=0)]
    return np.array([[[p.mean() for p in np.array_split(b, 8, 1)] for b in np.array_split(i, 8)] for i in images])


def test_frames_on_both_sides_are_tracked_to_a_millimetre(run, digitised):
    motion = run[1].motion
    assert motion.index.tolist() == list(range(STOP))
    assert set(motion.status) == {"tracked"}
    truth = np.array([[digitised[index][f"{axis}_m"] for axis in "xyz"] for index in motion.index])
    assert np.linalg.norm(motion.position - truth, axis=1).max() < 2e-3


def test_videos_show_the_frames_in_the_order_of_time(run, thrown_cross):
    drawn, taken = levels(run[0] / "videos" / "overlay_cam1.mp4"), levels(thrown_cross / "cam1.mp4")
    assert len(drawn) == STOP
    nearest = [int(np.argmin(np.abs(taken[: STOP // 2] - each).sum(axis=(1, 2)))) for each in drawn]
    assert nearest == sorted(nearest)
    assert {0, STOP // 2 - 1} <= set(nearest)


def test_the_start_and_what_follows_are_as_without_the_frames_before(middle, run, tmp_path):
    alone = track_trial(middle(None), tmp_path / "run", pictures=False).motion
    assert alone.index.tolist() == list(range(MIDDLE, STOP))
    np.testing.assert_array_equal(alone.position, run[1].motion.position[MIDDLE:])


@pytest.mark.parametrize("killed_at", [MIDDLE + 1, -MIDDLE, -MIDDLE + 2])
def test_a_run_that_is_killed_goes_on_to_the_same_result(middle, run, tmp_path, monkeypatch, killed_at):
    search = RefinedTracker.search

    def search_until(self, state, observed):
        if observed.index == killed_at:
            raise KeyboardInterrupt
        return search(self, state, observed)

    with monkeypatch.context() as patched:
        patched.setattr(RefinedTracker, "search", search_until)
        with pytest.raises(KeyboardInterrupt):
            track_trial(middle(0), tmp_path / "run", pictures=False)
    track_trial(middle(0), tmp_path / "run", resume=True, pictures=False)
    assert (tmp_path / "run" / "motion.csv").read_bytes() == (run[0] / "motion.csv").read_bytes()


def test_a_run_that_was_recorded_before_there_was_a_first_frame_goes_on(middle, tmp_path):
    alone = middle(None, every=3)
    track_trial(alone, tmp_path / "run", pictures=False)
    path = tmp_path / "run" / RUN_RECORD
    record = json.loads(path.read_text())
    del record["settings"]["start"]
    path.write_text(json.dumps(record))
    with pytest.raises(ResultError, match="start = None, now 0"):
        track_trial(middle(0, every=3), tmp_path / "run", resume=True, pictures=False)
    assert track_trial(alone, tmp_path / "run", resume=True, pictures=False).motion.index.tolist() == [
        MIDDLE,
        MIDDLE + 3,
    ]


def test_of_every_second_frame_the_start_is_one(middle, tmp_path):
    motion = track_trial(middle(1, every=2), tmp_path / "run", pictures=False).motion
    assert motion.index.tolist() == [NEXT - 2, NEXT, MIDDLE, MIDDLE + 2]
    assert set(motion.status) == {"tracked"}


def test_a_mask_before_the_start_is_tracked_again_alone(middle, run, tmp_path):
    folder = tmp_path / "run"
    track_trial(middle(0), folder, pictures=False)
    masked = middle(0).model_copy(update={"mask": [MaskTable(camera="cam1", first=1, last=2)]})
    motion = track_trial(masked, folder, resume=True, pictures=False).motion
    assert motion.n_views.tolist() == [3, 2, 2] + [3] * (STOP - 3)
    np.testing.assert_array_equal(motion.position[MIDDLE:], run[1].motion.position[MIDDLE:])


def test_the_first_frame_alone_is_the_start(middle, tmp_path):
    motion = track_trial(middle(0), tmp_path / "run", pictures=False, first_frame=True).motion
    assert motion.index.tolist() == [MIDDLE]


def test_check_counts_the_frames_before_the_start(thrown_cross, tmp_path):
    for file in thrown_cross.iterdir():
        (tmp_path / file.name).symlink_to(file)
    changes = ('control_points = "control_points.csv"', CALIBRATED), ("frame = 0", f"frame = {MIDDLE}")
    lines: list[str] = []
    path = edit_trial(tmp_path / "trial.toml", "back.toml", *changes, ("[track]", f"[track]\nstart = 2\nstop = {STOP}"))
    check_trial(path, lines.append)
    assert f"frames: {STOP - 2} to track" in lines


def test_a_first_frame_after_the_start_is_refused(thrown_cross):
    with pytest.raises(TrialError, match=r"track\.start = 4 lies after start\.frame = 0"):
        read_trial(thrown_cross / "trial.toml", {"start": 4})
