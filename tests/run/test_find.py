"""`airborne find`, `airborne frame`, and `airborne track` without [start]."""

import json
import shutil
import tomllib
from dataclasses import replace

import cv2
import numpy as np
import pytest

from airborne.cli import main
from airborne.errors import ResultError, TrialError, UndecidedError
from airborne.evaluation import read_truth
from airborne.geometry.rotations import geodesic
from airborne.run import find
from airborne.run.check import check_trial
from airborne.run.frame import write_frame
from airborne.run.moving_mix_ups import MovingSilhouettes
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from tests.support.example_trial import light_cross
from tests.support.places import THROWN_CROSS

pytestmark = pytest.mark.usefixtures("_plain_figures")

TRUTH = read_truth(THROWN_CROSS / "truth.csv")


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """The example without its start, with exact cameras."""
    folder = tmp_path_factory.mktemp("find") / "trial"
    shutil.copytree(light_cross(), folder)
    text = (folder / "trial.toml").read_text(encoding="utf-8")
    text = text.replace('control_points = "control_points.csv"', 'file = "calib_true.toml"')
    text = text[: text.index("[start]")] + text[text.index("[track]") :]
    (folder / "trial.toml").write_text(text, encoding="utf-8")
    return folder / "trial.toml"


def once(function):
    """A function that is done at the first of its calls, all of which are about the same trial."""
    done = []

    def remembered(*given):
        if not done:
            done.append(function(*given))
        return done[0]

    return remembered


@pytest.fixture(scope="module")
def found_once():
    """What of the whole trial is looked at and found, done once."""
    return {name: once(getattr(find, name)) for name in ("find_thing", "empty_scenes", "look")}


@pytest.fixture
def searched(found_once, monkeypatch):
    for name, function in found_once.items():
        monkeypatch.setattr(find, name, function)


def cli(monkeypatch, *words):
    """Run the command line; return its exit code."""
    monkeypatch.setattr("sys.argv", ["airborne", *map(str, words)])
    with pytest.raises(SystemExit) as stopped:
        main()
    return stopped.value.code or 0


@pytest.mark.usefixtures("searched")
def test_find_prints_a_start_that_is_right(path, tmp_path, monkeypatch, capsys):
    assert cli(monkeypatch, "find", path, "-o", tmp_path / "out") == 0
    start = tomllib.loads(capsys.readouterr().out)["start"]
    row = list(TRUTH.index).index(start["frame"])
    assert start["frame"] == 0
    assert np.linalg.norm(np.array(start["position_m"]) - TRUTH.position[row]) < 0.02

    (path.parent / "found.toml").write_text(
        path.read_text(encoding="utf-8")
        + f"[start]\nframe = {start['frame']}\nposition_m = {start['position_m']}\n"
        + f"quaternion_xyzw = {start['quaternion_xyzw']}\n",
        encoding="utf-8",
    )
    R = read_trial(path.parent / "found.toml").start.world_from_root.rotation.as_matrix()
    flipped = R @ np.diag([-1.0, 1.0, -1.0])  # the cross looks the same from behind
    assert min(geodesic(R, TRUTH.R[row]), geodesic(flipped, TRUTH.R[row])) < np.radians(3)
    assert read_trial(path).start.find


def test_a_trial_without_a_start_is_tracked_and_says_how_it_began(path, tmp_path):
    trial = read_trial(path)
    trial = trial.model_copy(update={"track": trial.track.model_copy(update={"stop": 12})})
    run = track_trial(trial, tmp_path / "run")
    assert run.summary["n_tracked"] == 12
    assert run.summary["events"][0].startswith("[start] was found: the body stands out best in frame ")
    assert (tmp_path / "run" / "figures" / "empty_scene.png").is_file()
    assert "How the start was found" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("searched")
def test_an_undecided_start_stops_with_its_candidates_and_one_is_taken(path, tmp_path, monkeypatch, capsys):
    decide = find.find_thing

    def undecided(model, moments, progress):
        finding = decide(model, moments)
        first = finding.candidates[0]
        other = replace(first, pose=first.pose.move(np.array([0, 0, 0.3]), np.zeros(3)), probability=0.4)
        return replace(finding, candidates=(replace(first, probability=0.6), other))

    monkeypatch.setattr(find, "find_thing", undecided)
    out = tmp_path / "out"
    assert cli(monkeypatch, "track", path, "-o", out) == 3
    said = " ".join(capsys.readouterr().err.split())
    assert "2 poses in frame" in said and "the likeliest 60%" in said and "--take 1" in said
    written = json.loads((out / "candidates.json").read_text(encoding="utf-8"))
    assert [each["probability"] for each in written["candidates"]] == [0.6, 0.4]
    assert (out / "candidates.png").is_file()
    trial = read_trial(path)
    with pytest.raises(TrialError, match="there is no candidate 3"):
        find.find_start(trial, out, take=3)
    run = track_trial(trial, out, take=1, first_frame=True, pictures=False)
    assert run.summary["n_tracked"] == 1
    assert run.summary["events"][0].startswith("[start] is candidate 1, as --take says: the body stands out best")
    assert "turned poses of this body look alike" in run.summary["events"][0]
    again = track_trial(trial, out, resume=True, first_frame=True, pictures=False)  # the run knows what it took
    assert again.summary["n_tracked"] == 1
    with pytest.raises(ResultError, match="take 1, now 2"):
        track_trial(trial, out, take=2, resume=True, first_frame=True, pictures=False)


@pytest.mark.usefixtures("searched")
def test_poses_that_disagree_with_what_moves_are_not_called_likely(path, tmp_path, monkeypatch):
    find_thing = find.find_thing

    def disagreeing(model, moments, progress):
        finding = find_thing(model, moments)
        first = replace(finding.candidates[0], is_plausible=False, precision=0.2, recall=0.1)
        return replace(finding, candidates=(first,))

    drawn: list[str] = []
    monkeypatch.setattr(find, "find_thing", disagreeing)
    monkeypatch.setattr(
        "airborne.export.finding.draw_candidates", lambda path, moment, poses: drawn.extend(text for text, _ in poses)
    )
    with pytest.raises(UndecidedError, match=r"20% of the outline .*check that each camera has its own video"):
        find.find_start(read_trial(path), tmp_path)
    assert drawn == ["disagrees: 20% stands out"]
    (written,) = json.loads((tmp_path / "candidates.json").read_text(encoding="utf-8"))["candidates"]
    assert written["is_plausible"] is False


def test_what_cannot_be_found_is_said(path, tmp_path):
    trial = read_trial(path)
    with pytest.raises(TrialError, match="finding the body needs two cameras"):
        find.find_start(trial.model_copy(update={"camera": trial.camera[:1]}), tmp_path)
    few = trial.model_copy(update={"track": trial.track.model_copy(update={"stop": 4})})
    with pytest.raises(TrialError, match=r"pictures? of each camera.*: too few to tell the empty scene, 5 at least"):
        find.find_start(few, tmp_path)


def test_check_says_that_the_body_will_be_looked_for(path):
    checks = check_trial(path)
    assert checks.mistakes == []
    assert "start: not given; the body is looked for when the trial is tracked" in checks.well


def test_check_reads_the_keys_of_a_trial_without_a_start_too(path):
    keyed = path.parent / "keyed.toml"
    keyed.write_text(f"{path.read_text()}\n[[key]]\nframe = 3\njoints_m = {{ nose = [0.0, 0.0, 1.0] }}\n")
    (mistake,) = check_trial(keyed).mistakes
    assert "nose" in mistake


def test_frame_writes_the_pixels_to_click_in(path, tmp_path, monkeypatch):
    picture = tmp_path / "f.png"
    assert cli(monkeypatch, "frame", path, "--camera", "cam2", "--frame", 5, "-o", picture) == 0
    rgb = cv2.imread(str(picture))
    assert rgb.shape == (576, 768, 3)
    trial = read_trial(path)
    with pytest.raises(TrialError, match="no camera 'cam9'; it has: cam1, cam2, cam3"):
        write_frame(trial, "cam9", 0, picture)
    with pytest.raises(TrialError, match="cam1 has no image at frame 999; frames are 0 to"):
        write_frame(trial, "cam1", 999, picture)
    with pytest.raises(TrialError, match=r"cannot be written; give a file .* that ends in \.png"):
        write_frame(trial, "cam1", 0, tmp_path / "none" / "f.png")


def test_undecided_is_an_error_of_the_trial():
    assert issubclass(UndecidedError, TrialError)


@pytest.mark.parametrize(
    ("probability", "says"), [(0.6, "probability 60%"), (0.984, "probability 98%"), (1.0, "probability over 99%")]
)
def test_no_start_is_said_to_be_certain(probability, says):
    assert find.describe_probability(probability) == says


@pytest.mark.usefixtures("searched")
def test_what_makes_the_videos_doubtful_is_said_with_the_start_and_where_none_is_decided(path, tmp_path, monkeypatch):
    doubtful = MovingSilhouettes(0.5, ("those without cam2 can: was it moved?",))
    monkeypatch.setattr(find, "compare_silhouettes", lambda moments: doubtful)
    found = find.find_start(read_trial(path), tmp_path)
    assert found.notes[0].startswith("[start] was found")
    assert found.notes[1:] == doubtful.doubts
    decide = find.find_thing
    monkeypatch.setattr(
        find,
        "find_thing",
        lambda *given: replace(
            decide(*given), candidates=tuple(replace(each, is_plausible=False) for each in decide(*given).candidates)
        ),
    )
    with pytest.raises(UndecidedError, match=r"those without cam2 can: was it moved\? look at"):
        find.find_start(read_trial(path), tmp_path)
