"""Cameras put on one clock through the command line, on the bundled example."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from airborne import cli
from airborne.errors import TrialError
from airborne.sync import Offsets
from airborne.sync.from_trial import round_to_images, synchronise, write_offsets
from airborne.trial.file import read_trial
from airborne.video import VideoSource
from tests.support.example_trial import copy_cross
from tests.support.places import THROWN_CROSS
from tests.support.tolerances import EXACT

EXAMPLE = THROWN_CROSS
NAMES = ("cam1", "cam2", "cam3")
FIELD_S = 0.02


@pytest.fixture
def trial(tmp_path) -> Path:
    return copy_cross(tmp_path / "thrown", is_light=False) / "trial.toml"


def offsets(offset_s, sd_s=(0, 0.001, 0.002), drift=(0, 0, 0)) -> Offsets:
    return Offsets(NAMES, *(np.array(each, float) for each in (offset_s, sd_s, drift, (0, 0, 0))), how="by hand")


def run(monkeypatch, *words) -> int:
    monkeypatch.setattr("sys.argv", ["airborne", *map(str, words)])
    with pytest.raises(SystemExit) as left:
        cli.main()
    return int(left.value.code or 0)


def test_motion_finds_the_examples_cameras_in_time_and_writes_it_down(trial, monkeypatch, capsys):
    before = trial.read_text()
    assert run(monkeypatch, "sync", trial, "--by", "motion", "--within", 0.2) == 0
    output = capsys.readouterr().out
    assert "cam3: offset" in output
    assert str(trial) in output
    cameras = tomllib.loads(trial.read_text())["camera"]
    assert [abs(camera.get("offset_s", 0)) < 1e-3 for camera in cameras] == [True] * 3
    assert all(0 < camera["offset_sd_s"] < 1e-3 for camera in cameras[1:])
    left = [line for line in trial.read_text().splitlines() if not line.startswith("offset")]
    assert left == before.splitlines()


def test_a_dry_run_writes_nothing_and_json_holds_the_numbers(trial, monkeypatch, capsys):
    before = trial.read_text()
    words = "sync", trial, "--by", "motion", "--within", 0.1, "--whole-pictures", "--dry-run", "--json"
    assert run(monkeypatch, *words) == 0
    found = json.loads(capsys.readouterr().out)
    assert [(camera["name"], camera["offset_s"]) for camera in found["cameras"]] == [(name, 0) for name in NAMES]
    assert trial.read_text() == before


def test_offsets_written_are_read_back_and_replace_old_ones(trial):
    write_offsets(trial, offsets((0, 0.0123456, -0.02), drift=(0, 2.5e-5, 0)))
    write_offsets(trial, offsets((0, -0.004, 0.007)))
    cameras = read_trial(trial).camera
    assert [camera.offset_s for camera in cameras] == [0, -0.004, 0.007]
    assert [camera.offset_sd_s for camera in cameras] == [0, 0.001, 0.002]
    assert [camera.drift_ppm for camera in cameras] == [0, 0, 0]
    assert trial.read_text().count("offset_s =") == 2


def test_drift_is_kept_in_millionths(trial):
    write_offsets(trial, offsets((0, 0.0123456, -0.02), drift=(0, 2.5e-5, 0)))
    camera = read_trial(trial).camera[1]
    assert (camera.offset_s, camera.drift_ppm) == (0.012346, 25.0)
    source = VideoSource("cam2", trial, "progressive", camera.offset_s, camera.drift_ppm)
    assert abs(float(source.trial_time(100)) - (100 * (1 + 25e-6) + 0.012346)) < EXACT


LISTED = """name = "my throw"
camera = [
    { name = "cam1", video = "cam1.mp4" },  # the clock
    { name = "cam2", video = "cam2.mp4", offset_s = 0.5, fields = "top-first" },
    { name = "cam3", video = "cam3.mp4" },
]
calibration = { file = "calib.toml" }
"""


def test_cameras_in_a_list_get_their_offsets_in_their_entries(tmp_path):
    path = tmp_path / "trial.toml"
    path.write_text(LISTED)
    write_offsets(path, offsets((0, -0.004, 0.007)))
    found = tomllib.loads(path.read_text())
    assert [camera.get("offset_s") for camera in found["camera"]] == [None, -0.004, 0.007]
    assert [camera.get("offset_sd_s") for camera in found["camera"]] == [None, 0.001, 0.002]
    assert found["camera"][1]["fields"] == "top-first"
    assert "# the clock" in path.read_text()
    write_offsets(path, offsets((0, 0.001, 0.002)))
    assert [camera.get("offset_s") for camera in tomllib.loads(path.read_text())["camera"]] == [None, 0.001, 0.002]


COMMENTED = """# measured in May
[[camera]]
name = "cam1"  # the clock

# beside the board
  [[camera]]
  name = 'cam2'
  offset_s = 0.5  # as seen by eye
  drift_ppm = 3.0

[[camera]]
"name" = "cam3"
# the last one

[calibration]
file = "calib.toml"
"""


def test_comments_order_and_layout_stay(tmp_path):
    path = tmp_path / "trial.toml"
    path.write_text(COMMENTED)
    write_offsets(path, offsets((0, -0.004, 0.007)))
    clock = "  offset_s = -0.004  # as seen by eye\n  offset_sd_s = 0.001\n"
    expected = COMMENTED.replace("  offset_s = 0.5  # as seen by eye\n  drift_ppm = 3.0\n", clock)
    expected = expected.replace('"cam3"\n', '"cam3"\noffset_s = 0.007\noffset_sd_s = 0.002\n')
    assert path.read_text() == expected


def test_a_file_that_has_other_cameras_by_now_is_left_alone(tmp_path):
    path = tmp_path / "trial.toml"
    path.write_text(LISTED.replace("cam3", "cam4"))
    with pytest.raises(TrialError, match=r"'cam4'.*run sync again"):
        write_offsets(path, offsets((0, 0, 0)))
    assert path.read_text() == LISTED.replace("cam3", "cam4")


def test_whole_images_are_rounded_to_and_doubts_noted():
    sources = [VideoSource(name, EXAMPLE / f"{name}.mp4", "top-first") for name in NAMES]
    found = round_to_images(offsets((0, 0.041, -0.0085), sd_s=(0, 0.001, 0.001)), sources)
    assert np.allclose(found.offset_s, (0, 2 * FIELD_S, 0), atol=EXACT)
    assert len(found.notes) == 1
    assert "cam3 lies 8.5 ms beside a whole image" in found.notes[0]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--by", "flash"), "no flash seen by cam1, cam2, cam3"),
        (("--by", "sound"), "cam1: .* has no sound"),
        (("--by", "motion", "--drift"), "drift cannot be estimated by motion"),
        (("--by", "guess"), "guess"),
        (("--within", "0"), "within"),
    ],
)
def test_what_cannot_be_had_is_refused_in_one_line(trial, monkeypatch, capsys, options, expected):
    before = trial.read_text()
    assert run(monkeypatch, "sync", trial, *options) == 2
    error = capsys.readouterr().err.strip()
    assert len(error.splitlines()) == 1
    assert re.search(expected, error)
    assert trial.read_text() == before


def test_one_camera_has_nothing_to_be_in_time_with(trial):
    with pytest.raises(TrialError, match="one camera"):
        synchronise(read_trial(trial, cameras=["cam1"]))


def test_tracking_that_starts_nowhere_says_so(trial):
    text = trial.read_text().replace("position_m = [-0.42419, -0.01495, 1.26533]", "position_m = [9.0, 9.0, 1.3]")
    trial.write_text(text + "stop = 12\n")
    with pytest.raises(TrialError, match="tracked at 0 moments"):
        synchronise(read_trial(trial), by="tracking")


def test_tracking_finds_a_camera_that_is_half_a_field_late(trial):
    late_s = FIELD_S / 2
    text = trial.read_text().replace('name = "cam3"', f'name = "cam3"\noffset_s = {late_s}')
    trial.write_text(text + "stop = 12\n")
    found = synchronise(read_trial(trial), by="tracking")
    assert found.offset_s[0] == 0
    assert abs(found.offset_s[1]) < 1e-3 and abs(found.offset_s[2]) < 1e-3, "both cameras are in time"
    assert (found.offset_sd_s[1:] < 1e-3).all()
    assert (abs(found.offset_s[1:]) < 4 * found.offset_sd_s[1:]).all()
