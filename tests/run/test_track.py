"""One loop for all runs: every input is read once."""

import sys
from collections import Counter

import pytest

from airborne.body.files import read_body
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import read_rig
from airborne.cameras.detections import read_detections
from airborne.run.body import BodyRun
from airborne.run.opening import open_trial
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from airborne.video import inspect
from tests.run.test_first_pose import DETECTIONS, RIG, detections, trial  # noqa: F401, the fixture

READERS = (inspect, read_rig, read_control_points, read_body, read_detections)


@pytest.fixture
def calls(monkeypatch):
    """Count the calls of the readers, by name and first argument, wherever they are imported."""
    counts = Counter()

    def n_done(reader):
        def call(what, *args, **kwargs):
            counts[reader.__name__, str(getattr(what, "path", what)).rpartition("/")[2]] += 1
            return reader(what, *args, **kwargs)

        return call

    for reader in READERS:
        replacement = n_done(reader)
        for name, module in list(sys.modules.items()):
            if name.startswith("airborne") and getattr(module, reader.__name__, None) is reader:
                monkeypatch.setattr(module, reader.__name__, replacement)
    return counts


def test_the_example_opens_every_file_once(thrown_cross, tmp_path, calls):
    track_trial(read_trial(thrown_cross / "trial.toml", {"stop": 1}), tmp_path / "run", pictures=False)
    videos = {("inspect", f"cam{i}.mp4"): 1 for i in (1, 2, 3)}
    assert calls == {**videos, ("read_control_points", "control_points.csv"): 1, ("read_body", "cross.toml"): 1}


def test_a_trial_with_detections_opens_every_file_once(trial, calls):  # noqa: F811
    given = trial(DETECTIONS, tables=detections())
    BodyRun.open(given, open_trial(given))
    videos = {("inspect", f"{name}.mkv"): 1 for name in RIG.names}
    assert calls == {**videos, ("read_rig", "calib.toml"): 1, ("read_detections", "found.npz"): 1}
