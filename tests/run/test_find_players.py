"""`airborne track` and `airborne find` of players without [start], from videos."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from airborne.cameras import Rig, write_pose2sim
from airborne.errors import ResultError, TrialError, UndecidedError
from airborne.run import find_players
from airborne.run.check import check_trial
from airborne.run.track import track_trial
from airborne.tracking.first_pose import players
from airborne.trial.file import read_trial
from tests.run.test_find import cli
from tests.support.clips import write_clip
from tests.support.jumping_scenes import CAMERAS, FPS, Hall, hop

HALL = Hall({"left": hop((-0.1, -0.7), heading=np.pi, late_s=9), "right": hop((0.9, -0.6), heading=np.pi, late_s=9)})
N_FRAMES = 3
TRIAL = """name = "block"
camera = [{ name = "cam0", video = "0.mkv" }, { name = "cam1", video = "1.mkv" }, { name = "cam2", video = "2.mkv" }]
calibration = { file = "calib.toml" }
body = { preset = "legs" }
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("players")
    views = [HALL.frames(index).views for index in range(N_FRAMES)]
    for number in range(len(CAMERAS)):
        pictures = [each[number].rgb for each in views]
        write_clip(folder / f"{number}.mkv", pictures, codec="libx264", pix_fmt="yuv444p", rate=FPS)
    write_pose2sim(folder / "calib.toml", Rig(CAMERAS))
    (folder / "trial.toml").write_text(TRIAL)
    return folder / "trial.toml"


@pytest.fixture(scope="module")
def finding(path):
    """What is found, once, in one moment: that two are searched is for the tests of what finds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(players, "_MOST_SEARCHED", 1)
        return find_players.find_players_start(read_trial(path), path.parent / "out", take=1).finding


def test_players_without_a_start_are_found_and_tracked_from_the_first_frame(path, finding, tmp_path, monkeypatch):
    monkeypatch.setattr(find_players, "find_players", lambda *args, **kwargs: sure(finding))
    run = track_trial(read_trial(path), tmp_path / "run", pictures=False)
    assert run.motion.players == ("player1", "player2")
    assert run.motion.index[0] == 0
    assert run.summary["events"][0].startswith("[[start.player]]: 2 players found, who stand out in frame ")
    joints = [run.motion.joints.index(name) for name in ("hip_left", "knee_left", "ankle_left")]
    for number, name in enumerate(HALL.motions):
        off_m = run.motion.points[0, number, joints] - HALL.truth(name, 0)[[0, 2, 4]]
        assert np.linalg.norm(off_m, axis=1).mean() < 0.05


def sure(finding, probability=0.99):
    best = finding.candidates[0]
    players = tuple(replace(player, evidence=2.0, probability=1.0) for player in best.players)
    return replace(finding, candidates=(replace(best, players=players, share=probability),))


def test_find_prints_a_start_that_a_trial_can_have(path, finding, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(find_players, "find_players", lambda *args, **kwargs: sure(finding))
    assert cli(monkeypatch, "find", path, "-o", tmp_path / "out") == 0
    printed = capsys.readouterr().out
    assert [player["name"] for player in tomllib.loads(printed)["start"]["player"]] == ["player1", "player2"]
    again = path.parent / "found.toml"
    again.write_text(TRIAL + printed, encoding="utf-8")
    assert not read_trial(again).start.find


def test_an_undecided_start_leaves_candidates_to_choose_from(path, finding, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(find_players, "find_players", lambda *args, **kwargs: sure(finding, 0.6))
    out = tmp_path / "out"
    assert cli(monkeypatch, "track", path, "-o", out) == 3
    said = " ".join(capsys.readouterr().err.split())
    assert "the players' start is undecided" in said and "60%" in said and "--take 1" in said
    (candidate,) = json.loads((out / "candidates.json").read_text(encoding="utf-8"))["candidates"]
    assert [player["name"] for player in candidate["players"]] == ["player1", "player2"]
    assert (out / "candidates.png").is_file()
    trial = read_trial(path)
    with pytest.raises(TrialError, match="there is no candidate 2"):
        find_players.find_players_start(trial, out, take=2)
    with pytest.raises(UndecidedError):
        find_players.find_players_start(trial, out)


def test_one_camera_and_live_runs_are_refused_and_check_says_what_will_happen(path, tmp_path):
    trial = read_trial(path)
    with pytest.raises(TrialError, match="finding players needs two cameras"):
        find_players.find_players_start(trial.model_copy(update={"camera": trial.camera[:1]}), tmp_path)
    with pytest.raises(ResultError, match="a live run looks for nobody"):
        track_trial(trial, tmp_path / "run", live=True)
    assert "start: not given; the players are looked for when the trial is tracked" in check_trial(path).well
