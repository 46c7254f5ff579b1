"""Runs of several players: tables that grow as they go, runs that are killed, cameras that fail, live pictures."""

import json
import os
import re
import threading
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airborne.cameras import read_rig
from airborne.cli.track import _describe
from airborne.errors import AirborneError, ResultError, TrialError
from airborne.motion import read_players
from airborne.motion.players import PLAYERS_COLUMNS
from airborne.run.track import track_trial
from airborne.tracking import Status
from airborne.trial.file import read_trial
from tests.cli.test_cli import in_process
from tests.support.clips import write_clip
from tests.support.docs import DOCS, named, table_of
from tests.support.players_trial import BYSTANDER, PLAYERS, StandIn, pictures, points_of, stand_in, write_trial
from tests.support.run_files import files_of

TABLES = {
    *("joints.csv", "tables/joints.parquet", "jumps.csv"),
    *("summary.json", "run.json", "calib.toml"),
}
OF_TRIAL = {"[start]", "[lights]", "[calibration]", "[body]", "[[camera]]"}
PICTURES = {
    *("report.html", "figures/heights.png"),
    *("videos/overlay_left.mp4", "videos/overlay_right.mp4", "videos/pictures.json"),
}


@pytest.fixture(autouse=True)
def _stand_in(monkeypatch):
    stand_in(monkeypatch)


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    return write_trial(tmp_path_factory.mktemp("trial"), 12)


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_a_run_leaves_every_players_joints_at_every_frame(path, tmp_path):
    run = track_trial(read_trial(path), tmp_path / "run", pictures=False)
    assert set(files_of(tmp_path / "run")) == TABLES
    motion = read_players(tmp_path / "run" / "joints.csv")
    assert motion.players == tuple(PLAYERS)
    assert motion.index.tolist() == list(range(12))
    assert motion.rate == pytest.approx(50)
    np.testing.assert_array_equal(motion.points[0, 1], points_of(PLAYERS["number 7"]))
    np.testing.assert_array_equal(run.motion.points, motion.points)
    assert read_rig(tmp_path / "run" / "calib.toml").names == ("left", "right")


def test_without_pyarrow_a_run_leaves_no_parquet(path, tmp_path, monkeypatch):
    monkeypatch.setattr("airborne.motion.players.CAN_WRITE_PARQUET", False)
    run = track_trial(read_trial(path), tmp_path / "run", pictures=False)
    assert set(files_of(tmp_path / "run")) == TABLES - {"tables/joints.parquet"}
    assert run.summary["tables"] == ["joints.csv", "jumps.csv"]


def test_the_summary_counts_each_player_and_names_the_inputs(path, tmp_path):
    track_trial(read_trial(path), tmp_path / "run", pictures=False)
    summary = summary_of(tmp_path / "run")
    assert (summary["n_frames"], summary["n_tracked"], summary["n_uncertain"], summary["n_lost"]) == (12, 9, 3, 0)
    assert (summary["rate_hz"], summary["start_s"], summary["duration_s"]) == (50, 0, 0.22)
    assert summary["players"]["Anna"] == {
        **{"n_tracked": 12, "n_uncertain": 0, "n_lost": 0, "n_fewer_cameras": 0, "n_below_two_cameras": 0},
        **{"median_sd_mm": pytest.approx(1e3 * np.sqrt(3e-4)), "median_score": -5.5, "doubts": []},
    }
    assert summary["players"]["number 7"]["n_uncertain"] == 3
    (doubt,) = summary["players"]["number 7"]["doubts"]
    said = f"number 7: uncertain: {doubt}; check them before use"
    assert said in summary["warnings"]
    assert _describe(summary, tmp_path / "run").count(doubt) == 1
    assert summary["bystanders"] == [BYSTANDER]
    assert summary["events"] == []
    assert set(summary["inputs"]) == {"left.mkv", "right.mkv", "calib.toml", *OF_TRIAL}
    assert summary["timings_s"]["tracking_a_frame"] * 12 == pytest.approx(summary["timings_s"]["tracking"])
    assert summary["tables"] == ["joints.csv", "jumps.csv", "tables/joints.parquet"]
    assert "live" not in summary


@pytest.mark.parametrize(("method", "n"), [("blocker", 1), ("block-jump", 2), ("mixture", 2), ("framework", 2)])
def test_particle_filters_warn_that_their_deviations_are_too_small(path, tmp_path, method, n):
    run = track_trial(read_trial(path, {"method": method, "stop": 2}), tmp_path / "run", pictures=False)
    warnings = run.summary["warnings"]
    assert len(warnings) == n
    assert n == 1 or (method in warnings[1] and "far too small" in warnings[1])


def test_videos_and_report_are_written_on_request(path, tmp_path):
    track_trial(read_trial(path, {"overlay": "broadcast"}), tmp_path / "run")
    assert set(files_of(tmp_path / "run")) == TABLES | PICTURES
    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "number 7: uncertain: all joints in " in report
    assert report.count("<img") == 1 and "http:" not in report.split("<style>")[0]


def test_everything_that_a_run_leaves_is_documented(path, tmp_path):
    run = track_trial(read_trial(path, {"stop": 2}), tmp_path / "run")
    page = DOCS / "reference" / "results.md"
    left = {re.sub(r"_(left|right)\.mp4", "_<camera>.mp4", name) for name in files_of(tmp_path / "run")}
    assert left == {name for row in table_of(page, "Files of a run of players") for name in named(row[0])}
    documented = [name for row in table_of(page, "`joints.csv` of players") for name in named(row[0])]
    assert sorted(documented) == sorted(PLAYERS_COLUMNS)
    keys = {name for row in table_of(page, "`summary.json` of players") for name in named(row[0])}
    assert keys == {*run.summary, "live"}


def test_start_every_and_stop_are_respected(tmp_path):
    trial = write_trial(tmp_path / "trial", 12, track="every = 2\nstop = 9", start="frame = 3")
    motion = track_trial(read_trial(trial), tmp_path / "run", pictures=False).motion
    assert motion.index.tolist() == [3, 5, 7]
    assert motion.rate == pytest.approx(25)


@pytest.mark.parametrize("share", [0.3, 0.71])
def test_a_killed_run_keeps_its_frames_and_goes_on_to_the_same_result(path, tmp_path, share):
    track_trial(read_trial(path), tmp_path / "whole", pictures=False)
    whole = (tmp_path / "whole" / "joints.csv").read_bytes()
    (tmp_path / "killed").mkdir()
    for name in ("run.json", "calib.toml"):
        (tmp_path / "killed" / name).write_bytes((tmp_path / "whole" / name).read_bytes())
    (tmp_path / "killed" / "joints.csv").write_bytes(whole[: int(share * len(whole))])
    track_trial(read_trial(path), tmp_path / "killed", resume=True, pictures=False)
    assert (tmp_path / "killed" / "joints.csv").read_bytes() == whole


def test_rows_are_out_before_the_next_frame_is_tracked(path, tmp_path, monkeypatch):
    seen = []

    class Watched(StandIn):
        def step(self, state, frames):
            table = tmp_path / "run" / "joints.csv"
            seen.append(len(table.read_text().splitlines()) - 1)
            return super().step(state, frames)

    stand_in(monkeypatch, Watched())
    track_trial(read_trial(path), tmp_path / "run", pictures=False)
    assert seen == [12 * k for k in range(12)]


def test_folders_of_other_runs_are_left_alone(path, tmp_path):
    track_trial(read_trial(path, {"stop": 2}), tmp_path / "run", pictures=False)
    with pytest.raises(ResultError, match="already holds a run"):
        track_trial(read_trial(path, {"stop": 2}), tmp_path / "run", pictures=False)
    with pytest.raises(ResultError, match="stop = 2, now 3"):
        track_trial(read_trial(path, {"stop": 3}), tmp_path / "run", resume=True, pictures=False)


def test_exports_of_the_run_before_are_named(path, tmp_path):
    trial, run = read_trial(path), tmp_path / "run"
    assert not any("export" in line for line in track_trial(trial, run, pictures=False).summary["warnings"])
    (run / "export").mkdir()
    warnings = track_trial(trial, run, overwrite=True, pictures=False).summary["warnings"]
    assert "export/ is of the run before; `airborne export` writes it anew" in warnings


def test_of_a_player_who_starts_in_the_air_no_frame_is_tracked(path, tmp_path):
    text = path.read_text()
    raised = re.sub(r"(ankle_\w+ = \[[^,]+, [^,]+, )0\.\d+", r"\g<1>0.4", text, count=2)
    assert raised != text
    path.with_name("raised.toml").write_text(raised)
    summary = track_trial(read_trial(path.with_name("raised.toml")), tmp_path / "run", pictures=False).summary
    assert [player["n_tracked"] for player in summary["players"].values()] == [0, 9]
    assert summary["players"]["Anna"]["start_doubt"].startswith("both ankles lie 0.40 m or more over")
    assert any(each.startswith("Anna: both ankles lie 0.40 m or more over") for each in summary["warnings"])


def test_a_start_past_the_end_is_refused(tmp_path):
    trial = write_trial(tmp_path / "trial", 4, start="frame = 30")
    with pytest.raises(TrialError, match="there is no frame 30"):
        track_trial(read_trial(trial), tmp_path / "run", pictures=False)


def test_cameras_that_end_or_go_dark_are_reported_with_their_frames(tmp_path):
    trial = write_trial(tmp_path / "trial", 12)
    folder = trial.parent
    write_clip(folder / "left.mkv", pictures(5), codec="libx264", pix_fmt="yuv420p")
    dark = [image if k not in (3, 4) else np.zeros_like(image) for k, image in enumerate(pictures(12))]
    write_clip(folder / "right.mkv", dark, codec="libx264", pix_fmt="yuv420p")
    run = track_trial(read_trial(trial), tmp_path / "run")
    assert len(run.motion) == 12
    assert "left: no image at 7 of 12 frames: frames 5 to 11" in run.summary["events"]
    assert "right: dark at 2 of 12 frames: frames 3 to 4" in run.summary["events"]
    assert run.summary["players"]["Anna"]["n_below_two_cameras"] == 7
    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "Anna: 7 of 12 frames rest on fewer than two cameras" in report
    assert "frames 5 to 11" in report


def test_the_command_line_tracks_players_and_says_how_each_was_found(path, tmp_path, capsys):
    assert in_process("track", path, "-o", tmp_path / "run", "--overlay", "broadcast", "--no-pictures") == 0
    out = capsys.readouterr().out
    assert "Anna: 12 tracked, 0 uncertain, 0 lost; median sd of a joint 17 mm" in out
    assert "number 7: 9 tracked, 3 uncertain" in out
    assert summary_of(tmp_path / "run")["method"]["overlay"] == "broadcast"


def test_an_interrupt_leaves_the_tracked_frames_and_says_so(path, tmp_path, capsys, monkeypatch):
    class Interrupted(StandIn):
        def step(self, state, frames):
            if frames.index == 5:
                raise KeyboardInterrupt
            return super().step(state, frames)

    stand_in(monkeypatch, Interrupted())
    assert in_process("track", path, "-o", tmp_path / "run", "--no-pictures") == 130
    assert "--resume goes on" in capsys.readouterr().err
    assert len(read_players(tmp_path / "run" / "joints.csv")) == 5
    stand_in(monkeypatch)
    assert in_process("track", path, "-o", tmp_path / "run", "--no-pictures", "--resume") == 0
    assert len(read_players(tmp_path / "run" / "joints.csv")) == 12


def test_live_files_are_tracked_at_their_own_speed_and_dropped_frames_are_reported(path, tmp_path, capsys):
    assert in_process("track", "--live", path, "-o", tmp_path / "run", "--no-pictures") == 0
    live = summary_of(tmp_path / "run")["live"]
    motion = read_players(tmp_path / "run" / "joints.csv")
    assert [camera["name"] for camera in live["cameras"]] == ["left", "right"]
    for camera in live["cameras"]:
        assert camera["n_received"] == 12 == camera["n_used"] + camera["n_dropped"]
        assert camera["n_used"] <= len(motion)
    assert motion.index[0] == 0 and (np.diff(motion.index) > 0).all()
    assert 0 < live["median_delay_s"] <= live["largest_delay_s"]
    assert "live: frames dropped to keep up: left" in capsys.readouterr().out


def test_live_pipes_end_with_an_interrupt_and_keep_whole_results(tmp_path, monkeypatch):
    trial = write_trial(tmp_path / "trial", 40, video="{}.pipe")
    for name in ("left", "right"):
        os.mkfifo(trial.parent / f"{name}.pipe")
    sent = [threading.Thread(target=_send, args=(trial.parent, name), daemon=True) for name in ("left", "right")]
    for thread in sent:
        thread.start()

    class Interrupted(StandIn):
        def step(self, state, frames):
            if frames.index >= 10:
                raise KeyboardInterrupt
            return super().step(state, frames)

    stand_in(monkeypatch, Interrupted())
    run = track_trial(read_trial(trial), tmp_path / "run", live=True)
    for thread in sent:
        thread.join(5)
    assert len(run.motion) >= 1 and run.motion.index[-1] < 40
    assert set(files_of(tmp_path / "run")) == TABLES | PICTURES
    assert set(run.summary["inputs"]) == {"calib.toml", *OF_TRIAL}


def _send(folder, name):
    """Push a file through a pipe."""
    with suppress(BrokenPipeError), open(folder / f"{name}.pipe", "wb") as pipe:
        pipe.write((folder / f"{name}.mkv").read_bytes())


def test_of_images_that_come_too_rarely_no_joint_is_tracked(path, tmp_path):
    run = track_trial(read_trial(path, {"every": 3}), tmp_path / "run", pictures=False)
    assert run.motion.rate < 29
    assert set(run.motion.joint_status.ravel().tolist()) == {"uncertain"}
    assert any("no joint is called tracked and no jump is measured" in each for each in run.summary["warnings"])


def test_live_runs_cannot_be_resumed_and_bodies_cannot_be_live(path, tmp_path, thrown_cross, capsys):
    with pytest.raises(AirborneError, match="cannot be resumed"):
        track_trial(read_trial(path), tmp_path / "run", live=True, resume=True)
    assert in_process("track", "--live", thrown_cross / "trial.toml", "-o", tmp_path / "run") == 2
    assert "--live is for players" in capsys.readouterr().err


@pytest.mark.parametrize(("status", "code"), [(Status.TRACKED, 0), (Status.UNCERTAIN, 1)])
def test_a_run_without_a_tracked_frame_exits_with_one(path, tmp_path, monkeypatch, status, code):
    class Doubtful(StandIn):
        def step(self, state, frames):
            state, estimates = super().step(state, frames)
            return state, tuple(replace(each, joint_status=6 * (status,)) for each in estimates)

    stand_in(monkeypatch, Doubtful())
    assert in_process("track", path, "-o", tmp_path / "run", "--no-pictures") == code


def test_a_run_in_which_everybody_is_lost_says_so_and_exits_with_one(path, tmp_path, capsys, monkeypatch):
    class Lost(StandIn):
        def step(self, state, frames):
            state, estimates = super().step(state, frames)
            nothing = {"points": np.full((6, 3), np.nan), "covariance": np.full((6, 3, 3), np.nan), "score": np.nan}
            return state, tuple(
                replace(each, joint_status=6 * (Status.LOST,), n_views=0, **nothing) for each in estimates
            )

    stand_in(monkeypatch, Lost())
    assert in_process("track", path, "-o", tmp_path / "run") == 1
    assert "Anna: 0 tracked, 0 uncertain, 12 lost; median sd of a joint not known" in capsys.readouterr().out
    assert "Anna: found in no frame" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
