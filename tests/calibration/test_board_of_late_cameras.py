"""A waved board before cameras that do not look at the same instant: time stamps say which images belong together."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration import calibrate_from, from_sources, sources_from
from airborne.calibration.initial.values import read_inputs
from airborne.calibration.sources.board_detection import detect_boards
from airborne.errors import CalibrationError
from tests.support.calibration_scenes import BOARD, board_at, board_pictures, three_side_by_side, write_videos
from tests.support.rigs import apart

RIG = three_side_by_side()
RATE, N = 10, 18
LATE_S = {"cam0": 0.0, "cam1": 0.025, "cam2": 0.0}  # what the stamps do not know


def write_stamps(path, ids, skip=()):
    """Write the table of all images as if every camera kept time."""
    lines = ["sync_index,cam_id,frame_time"]
    lines += [f"{k},{i},{k / RATE:.3f}" for k in range(N) for i in ids if (k, i) not in skip]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("late")
    time_s = np.arange(N) / RATE
    pictures = {}
    for camera in RIG:
        places = board_at(1.5 * (time_s + LATE_S[camera.name]))
        pictures[camera.name] = board_pictures(RIG.select([camera.name]), places)[camera.name]
    write_videos(folder, pictures, rate=RATE)
    write_stamps(folder / "stamps.csv", (0, 1, 2))
    return folder


def sources(folder, **board):
    cameras = [{"name": name, "video": f"{name}.mp4"} for name in RIG.names]
    document = {"camera": cameras, "board": {"file": "board.toml", "timestamps": "stamps.csv", **board}}
    return sources_from(document, folder, "test")


def silent(what, done, total):
    pass


def test_lags_are_found_and_the_rig_is_better_than_without(recording, monkeypatch):
    inputs = read_inputs(sources(recording), silent)  # the same for both
    monkeypatch.setattr(from_sources, "read_inputs", lambda sources, progress: replace(inputs, sources=sources))
    loose, exact = (calibrate_from(sources(recording, sync=sync), silent) for sync in ("auto", "exact"))
    late_s = {name: float(np.median(lag_s)) for name, lag_s in loose.lag_s.items()}
    for name, other in (("cam0", "cam1"), ("cam2", "cam1")):
        assert late_s[other] - late_s[name] == pytest.approx(LATE_S["cam1"], abs=0.004)
    assert exact.lag_s == {}
    off = [np.abs(apart(fit.rig) - apart(RIG)).max() for fit in (loose, exact)]
    assert off[0] < 0.5 * off[1]
    assert "do not look at the same instant" in loose.notes[-1]


def test_stamps_of_other_cameras_and_of_images_that_are_missing_are_said(recording):
    write_stamps(recording / "others.csv", (7, 8, 9))
    with pytest.raises(CalibrationError, match="no rows of camera 'cam0'; its cam_id are:"):
        read_inputs(sources(recording, timestamps="others.csv"), silent)
    write_stamps(recording / "half.csv", (0, 1, 2), skip={(k, camera) for k in range(0, 99, 2) for camera in range(3)})
    with pytest.raises(
        CalibrationError, match=r"rows of camera 'cam0', whose recording has \d+ images; give the table"
    ):
        read_inputs(sources(recording, timestamps="half.csv"), silent)
    write_stamps(recording / "gap.csv", (0, 1, 2), skip={(k, 1) for k in (10, 11, 12)})
    detections = detect_boards(sources(recording, timestamps="gap.csv"), BOARD, lambda done, n: None)
    assert [(finding.kind, finding.cameras) for finding in detections.findings] == [("clock", ("cam1",))]
