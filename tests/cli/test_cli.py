"""The command line on the bundled example: results, and going on after a kill."""

import json
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from airborne.motion import read_motion
from tests.support.commands import in_process, refusal
from tests.support.example_trial import CALIBRATED, LONG, SHORT, edit_trial
from tests.support.players_trial import write_run, write_truth
from tests.support.run_files import contents_of, files_of

pytestmark = pytest.mark.usefixtures("_plain_figures")

KILLED_AFTER = 4  # rows
PATIENCE_S = 120


def start_command(*arguments) -> subprocess.Popen:
    """Start a command of its own process, which Ctrl-C reaches even where the tests run in a shell's background."""
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{heed}; from airborne.cli import main; main()", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_rows(process: subprocess.Popen, motion: Path, rows: int) -> None:
    """Wait until a running command has written so many frames."""
    end = time.monotonic() + PATIENCE_S
    while not motion.exists() or motion.read_bytes().count(b"\n") <= rows:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.mark.quick
def test_track_prints_what_was_found_and_leaves_every_table(trial, tmp_path, capsys):
    assert in_process("track", trial, "-o", tmp_path / "run", "--no-pictures", "--cameras", "cam1, cam2") == 0
    out, err = capsys.readouterr()
    assert f"{SHORT} frames at 50 Hz: {SHORT} tracked, 0 uncertain, 0 lost" in out
    assert all(line.startswith(("tracking ", "airborne: compiling ")) for line in err.splitlines())
    names = set(files_of(tmp_path / "run"))
    assert names == {
        *(
            "motion.csv",
            "lasting.bin",
            "tables/motion.parquet",
            "tables/angles.csv",
            "tables/uncertainty.csv",
            "joints.csv",
        ),
        *("summary.json", "run.json", "calib.toml", "body.toml"),
    }
    assert list(tomllib.loads((tmp_path / "run" / "calib.toml").read_text())) == ["cam1", "cam2", "metadata"]


def test_method_and_every_replace_those_of_the_trial(trial, tmp_path, capsys):
    options = ("--method", "stepping", "--every", "2", "--no-pictures", "--json")
    assert in_process("track", trial, "-o", tmp_path / "run", *options) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["method"]["method"] == "stepping"
    assert summary["rate_hz"] == 25
    assert in_process("track", trial, "-o", tmp_path / "one", "--every", "100", "--no-pictures") == 0
    assert capsys.readouterr().out.startswith("1 frame: 1 tracked, ")
    assert read_motion(tmp_path / "run" / "motion.csv").index.tolist() == [0, 2]


def test_json_of_track_is_the_summary_file(trial, tmp_path, capsys):
    assert in_process("track", trial, "-o", tmp_path / "run", "--no-pictures", "--json") == 0
    assert capsys.readouterr().out == (tmp_path / "run" / "summary.json").read_text(encoding="utf-8")


def test_pictures_and_report_are_written_and_then_show_the_errors(trial, tmp_path, capsys):
    assert in_process("track", trial, "-o", tmp_path / "run") == 0
    names = set(files_of(tmp_path / "run"))
    assert names >= {
        *("report.html", "figures/through_mask.png", "figures/pose.png", "figures/score.png"),
        "videos/overlay_cam1.mp4",
    }
    assert "figures/errors.png" not in names
    capsys.readouterr()
    assert in_process("evaluate", tmp_path / "run", trial.parent / "truth.csv") == 0
    assert "position [mm]" in capsys.readouterr().out
    assert "figures/errors.png" in files_of(tmp_path / "run")
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["truth"]["n_matched"] == SHORT


def test_evaluate_compares_with_the_truth_and_with_clicks(trial, short_run, capsys):
    folder = trial.parent
    capsys.readouterr()
    arguments = ("evaluate", short_run, folder / "truth.csv", "--digitised", folder / "digitised.csv", "--json")
    assert in_process(*arguments) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["truth"]["n_matched"] == SHORT
    assert result["truth"]["position"]["rms_3d_mm"] < 10
    assert result["digitised"]["tracked_minus_digitised"]["n_matched"] == SHORT


def test_a_finished_run_that_is_resumed_stays_as_it_is(trial, short_run, tmp_path, capsys):
    run = tmp_path / "run"
    shutil.copytree(short_run, run)
    assert in_process("evaluate", run, trial.parent / "truth.csv") == 0
    before = contents_of(run)
    capsys.readouterr()
    assert in_process("track", trial, "-o", run, "--no-pictures", "--resume") == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"{run} holds this run, finished; nothing was tracked again (--overwrite tracks it anew)"
    assert said[1].startswith(f"{SHORT} frames at ")
    assert contents_of(run) == before


def test_calibrate_writes_cameras_that_track_takes(trial, tmp_path, capsys):
    out = trial.parent / "calib.toml"
    points = trial.parent / "control_points.csv"
    assert in_process("calibrate", points, "--size", "768x576", "-o", out) == 0
    assert "held-out" in capsys.readouterr().out
    assert in_process("calibrate", points, "--size", "cam1=768x576,cam2=768x576,cam3=768x576", "-o", out, "--json") == 0
    assert set(json.loads(capsys.readouterr().out)["cameras"]) == {"cam1", "cam2", "cam3"}
    for source in ('file = "calib.toml"', 'control_points = "control_points.csv"'):
        other = edit_trial(trial, "other.toml", (CALIBRATED, source))
        assert in_process("track", other, "-o", tmp_path / source[:4], "--no-pictures", "--cameras", "cam1,cam2") == 0
    motions = [read_motion(tmp_path / name / "motion.csv") for name in ("file", "cont")]
    assert abs(motions[0].position - motions[1].position).max() < 5e-3


def test_synth_cross_writes_a_trial_once(tmp_path, capsys, monkeypatch):
    asked = []
    monkeypatch.setattr("airborne.synthetic.write_thrown_cross", lambda folder, **options: asked.append(options))
    assert in_process("synth", "cross", "-o", tmp_path / "new", "--seed", "3", "--preset", "side-somersault") == 0
    assert (asked[0]["seed"], asked[0]["preset"]) == (3, "side-somersault")
    assert capsys.readouterr().out == f"trial: {tmp_path / 'new' / 'trial.toml'}\n"


def test_synth_block_writes_the_scene_that_was_asked_for(tmp_path, capsys, monkeypatch):
    asked = []
    monkeypatch.setattr("airborne.synthetic.write_block", lambda folder, scene, progress: asked.append((folder, scene)))
    options = ("--seed", "4", "--blockers", "2", "--difficulty", "hard", "--frame-rate", "30", "--cameras", "2")
    assert in_process("synth", "block", "-o", tmp_path / "new", *options) == 0
    ((folder, scene),) = asked
    assert (folder, scene.seed, len(scene.blockers), len(scene.rig)) == (tmp_path / "new", 4, 2, 2)
    assert (scene.rate, scene.difficulty.occlusion, scene.difficulty.colour_similarity) == (30, 0.8, 1.0)
    assert capsys.readouterr().out == f"trial: {tmp_path / 'new' / 'trial.toml'}\n"


def test_evaluate_compares_players_with_their_truth(tmp_path, capsys):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv", off_m=0.02)
    assert in_process("evaluate", run, truth) == 0
    out, _ = capsys.readouterr()
    assert out.startswith("against the truth\n12 of 12 true times matched")
    assert "number 7: 9 tracked, 3 uncertain, 0 lost" in out
    assert "nan" not in out
    assert in_process("evaluate", run, truth, "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["truth"]["players"]["Anna"]["parts"]["knees"]["mean_mm"] == pytest.approx(20)
    assert "leave clicked points" in refusal(capsys, "evaluate", run, truth, "--digitised", truth)
    assert "give a truth.csv" in refusal(capsys, "evaluate", run)
    assert "cannot be read" in refusal(capsys, "evaluate", run, tmp_path / "none.csv")


def test_bench_prints_what_it_measured(capsys, monkeypatch):
    monkeypatch.setattr("airborne.run.bench.measure_speed", lambda: {"refined_ms_per_field": 12.5})
    assert in_process("bench") == 0
    assert capsys.readouterr().out == "refined_ms_per_field: 12.5\n"
    assert in_process("bench", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"refined_ms_per_field": 12.5}


def test_demo_runs_again_in_its_own_folder_and_spares_any_other(trial, short_run, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("airborne.trial.examples.example_trial", lambda name: trial)
    shutil.copytree(short_run, tmp_path / "demo")
    assert in_process("demo", "-o", tmp_path / "demo", "--json") == 0
    assert set(json.loads(capsys.readouterr().out)) == {"truth", "digitised", "agreement", "repeatability"}
    assert (tmp_path / "demo" / "report.html").stat().st_size > 10_000
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "motion.csv").write_text("mine")
    assert in_process("demo", "-o", tmp_path / "mine") == 2
    assert (tmp_path / "mine" / "motion.csv").read_text() == "mine"


def test_a_killed_run_is_readable_and_resumes_to_the_same_bytes(trial, tmp_path):
    long = trial.with_name("long.toml")
    assert in_process("track", long, "-o", tmp_path / "whole", "--no-pictures") == 0
    process = start_command("track", long, "-o", tmp_path / "killed", "--no-pictures")
    wait_for_rows(process, tmp_path / "killed" / "motion.csv", KILLED_AFTER)
    process.kill()
    process.communicate()
    n_kept = len(read_motion(tmp_path / "killed" / "motion.csv"))
    assert KILLED_AFTER <= n_kept < LONG
    assert not (tmp_path / "killed" / "summary.json").exists()
    assert in_process("track", long, "-o", tmp_path / "killed", "--no-pictures", "--resume") == 0
    for name in ("motion.csv", "tables/angles.csv", "joints.csv"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize("signal_of_stop", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_ends_with_one_line_and_keeps_the_frames(trial, tmp_path, signal_of_stop):
    long = trial.with_name("long.toml")  # by simplex, slow enough not to end before the signal
    process = start_command("track", long, "-o", tmp_path / "run", "--no-pictures", "--method", "simplex")
    wait_for_rows(process, tmp_path / "run" / "motion.csv", 1)
    process.send_signal(signal_of_stop)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert out == ""
    assert len(err.splitlines()) == 1
    assert "--resume" in err
    assert len(read_motion(tmp_path / "run" / "motion.csv")) >= 1


def test_ctrl_c_is_answered_in_one_line_whatever_runs(monkeypatch, capsys):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.run.bench.measure_speed", interrupted)
    assert in_process("bench") == 130
    assert capsys.readouterr() == ("", "airborne: stopped\n")


def test_a_body_found_nowhere_is_reported(trial, tmp_path, capsys):
    far = edit_trial(trial, "far.toml", ("position_m = [-0.42419,", "position_m = [40.0,"))
    assert in_process("track", far, "-o", tmp_path / "run", "--no-pictures") == 1
    out, _ = capsys.readouterr()
    assert "found in no frame" in out
    assert "the start pose lies in no camera's image" in out
    assert "nan" not in out


def test_the_first_frame_says_what_to_open_also_where_it_failed(trial, tmp_path, capsys):
    far = edit_trial(trial, "far.toml", ("position_m = [-0.42419,", "position_m = [40.0,"))
    assert in_process("track", far, "-o", tmp_path / "run", "--first-frame") == 1
    out, _ = capsys.readouterr()
    drawn = [f"figures/overlay_cam{k}.png" for k in (1, 2, 3)]
    assert f"look at the first frame in {', '.join(drawn)} and correct [start]" in out
    assert f"results: {tmp_path / 'run'}; open {tmp_path / 'run' / drawn[0]}, " in out


def test_a_demo_that_is_stopped_goes_on_by_the_same_command(short_run, tmp_path, capsys, monkeypatch):
    folder, given = shutil.copytree(short_run, tmp_path / "demo"), []

    def interrupted(*arguments, **options):
        given.append((options["resume"], options["overwrite"]))
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.run.track.track_trial", interrupted)
    monkeypatch.setattr("airborne.run.folder.holds_run_of", lambda trial, folder: True)
    for name in ("report.html", "summary.json"):
        assert in_process("demo", "-o", folder) == 130
        assert capsys.readouterr().err.endswith(f"no frame was tracked yet; {folder} still holds the run before\n")
        (folder / name).unlink(missing_ok=True)
    assert in_process("demo", "-o", folder) == 130
    assert capsys.readouterr().err.endswith(f"kept in {folder}; the same command goes on\n")
    assert given == [(False, True), (False, True), (True, False)]


def test_a_stop_before_the_first_frame_leaves_nothing(trial, tmp_path, capsys, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.run.track.track_trial", interrupted)
    assert in_process("track", trial, "-o", tmp_path / "run") == 130
    assert capsys.readouterr() == ("", "airborne: stopped; no frame was tracked yet\n")


def test_a_stop_while_a_library_is_loaded_is_a_stop(trial, tmp_path, capsys, monkeypatch):
    def loading(*arguments, **options):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as stopped:
            raise ImportError("initialization failed") from stopped

    monkeypatch.setattr("airborne.run.check.check_trial", loading)
    assert in_process("check", trial) == 130
    assert capsys.readouterr().err.endswith("airborne: stopped\n")
