"""One plain line for every bad input of the command line."""

import os
import shutil
from pathlib import Path

import pytest

from airborne.cli import command_tree
from tests.support.commands import in_process, refusal
from tests.support.example_trial import CALIBRATED, SHORT, edit_trial

BROKEN_TRIALS = {  # what is replaced in trial.toml, and what the line says
    "broken TOML": (("[calibration]", "[calibration"), "not a TOML file"),
    "unknown key": ((f"stop = {SHORT}", "speed = 2"), "track.speed"),
    "missing video": (("cam2.mp4", "cam9.mp4"), "cam9.mp4 not found"),
    "text as video": (("cam2.mp4", "text.mp4"), "text.mp4 cannot be opened as a video"),
    "truncated video": (("cam2.mp4", "cut.mp4"), "cut.mp4 cannot be opened as a video"),
    "calibration of another size": ((CALIBRATED, 'file = "large.toml"'), "1920×1080"),
    "calibration lacks a camera": (
        (CALIBRATED, 'file = "two.toml"'),
        "no camera 'cam3'; it has: cam1, cam2; say",
    ),
    "folder as video": (("cam2.mp4", "."), "is not a file; give a video, or read pipes and devices with --live"),
    "no such calibration": ((CALIBRATED, 'file = "no.toml"'), "no.toml not found"),
    "start past the end": ((f"stop = {SHORT}", ""), "no frame 500"),
}


def spoil(folder: Path) -> None:
    """Write the files that broken trials name."""
    (folder / "text.mp4").write_text("no video\n")
    (folder / "cut.mp4").write_bytes((folder / "cam2.mp4").read_bytes()[:100_000])
    exact = (folder / "calib_true.toml").read_text()
    (folder / "large.toml").write_text(exact.replace("[ 768.0, 576.0]", "[ 1920.0, 1080.0]"))
    (folder / "two.toml").write_text(exact[: exact.index("[cam3]")])


def test_synth_block_refuses_what_it_cannot_draw(tmp_path, capsys):
    new = tmp_path / "new"
    assert "choose 30, 60 or 120" in refusal(capsys, "synth", "block", "-o", new, "--frame-rate", "50")
    assert "--blockers" in refusal(capsys, "synth", "block", "-o", new, "--blockers", "4")
    assert "--cameras" in refusal(capsys, "synth", "block", "-o", new, "--cameras", "1")
    assert "--difficulty" in refusal(capsys, "synth", "block", "-o", new, "--difficulty", "unfair")
    assert not new.exists()
    (tmp_path / "mine.txt").write_text("mine")
    assert "not empty" in refusal(capsys, "synth", "block", "-o", tmp_path)


@pytest.mark.parametrize("what", BROKEN_TRIALS)
def test_a_trial_that_cannot_be_used_gets_one_line(trial, tmp_path, capsys, what):
    spoil(trial.parent)
    replacement, output = BROKEN_TRIALS[what]
    broken = edit_trial(trial, "broken.toml", replacement)
    if what == "start past the end":
        broken = edit_trial(broken, "broken.toml", ("frame = 0", "frame = 500"))
    assert output in refusal(capsys, "track", broken, "-o", tmp_path / "run", "--no-pictures")


def test_arguments_that_name_nothing_get_one_line(trial, tmp_path, capsys):
    run = tmp_path / "run"
    assert "none.toml" in refusal(capsys, "track", trial.with_name("none.toml"), "-o", run)
    assert "cam7" in refusal(capsys, "track", trial, "-o", run, "--cameras", "cam1,cam7")
    assert "--cameras names no camera" in refusal(capsys, "track", trial, "-o", run, "--cameras", " , ")
    for kind in ("cross", "somersault", "block"):
        assert "--seed" in refusal(capsys, "synth", kind, "-o", run, "--seed", "-1")
    assert "--method magic: expected" in refusal(capsys, "track", trial, "-o", run, "--method", "magic")
    assert "--overlay paper: not read" in refusal(capsys, "track", trial, "-o", run, "--overlay", "paper")
    assert "holds no run" in refusal(capsys, "evaluate", tmp_path / "nowhere")
    assert not run.exists()


def test_a_folder_with_a_run_is_not_overwritten(trial, short_run, capsys):
    before = (short_run / "motion.csv").read_bytes()
    assert "already holds a run" in refusal(capsys, "track", trial, "-o", short_run)
    assert "another run" in refusal(capsys, "track", trial, "-o", short_run, "--resume", "--every", "2")
    assert (short_run / "motion.csv").read_bytes() == before


def test_a_damaged_record_of_a_run_is_not_guessed(trial, short_run, tmp_path, capsys):
    run = tmp_path / "run"
    shutil.copytree(short_run, run)
    (run / "run.json").write_text("{")
    for option in ("--resume", "--overwrite"):
        assert "run.json is damaged" in refusal(capsys, "track", trial, "-o", run, option)
    (run / "run.json").unlink()
    assert "run.json is missing" in refusal(capsys, "track", trial, "-o", run, "--resume")
    assert (run / "motion.csv").read_bytes() == (short_run / "motion.csv").read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="a path below a file fails in another way there")
def test_outputs_that_cannot_be_written_get_one_line(trial, tmp_path, capsys):
    (tmp_path / "file").write_text("not a folder")
    for out in (tmp_path / "file", tmp_path / "file" / "run"):
        assert f"{tmp_path / 'file'} is a file; give a folder\n" in refusal(capsys, "track", trial, "-o", out)
    calib, out = trial.parent / "calib_true.toml", tmp_path / "no" / "c.toml"
    assert f"there is no folder {out.parent}; make it" in refusal(capsys, "convert", calib, out)
    (tmp_path / "c.toml").mkdir()
    assert "c.toml is a folder; give a file's name" in refusal(capsys, "convert", calib, tmp_path / "c.toml")


def test_evaluate_says_what_it_lacks(trial, short_run, tmp_path, capsys):
    truth, clicks = trial.parent / "truth.csv", trial.parent / "digitised.csv"
    assert "holds no run" in refusal(capsys, "evaluate", tmp_path, truth)
    assert "nothing to compare with" in refusal(capsys, "evaluate", short_run)
    assert "no column" in refusal(capsys, "evaluate", short_run, clicks)
    assert "cannot be read" in refusal(capsys, "evaluate", short_run, tmp_path / "none.csv")
    assert "cameras: cam1, cam2, cam3" in refusal(capsys, "evaluate", short_run, "--digitised", truth)


def test_calibrate_says_what_it_lacks(trial, tmp_path, capsys):
    points, out = trial.parent / "control_points.csv", tmp_path / "calib.toml"
    assert "768x576" in refusal(capsys, "calibrate", points, "--size", "768", "-o", out)
    assert "cam2" in refusal(capsys, "calibrate", points, "--size", "cam1=768x576", "-o", out)
    assert "no column point" in refusal(capsys, "calibrate", trial.parent / "truth.csv", "--size", "768x576", "-o", out)
    assert "no.toml does not exist" in refusal(capsys, "calibrate", tmp_path / "no.toml", "--size", "10x10", "-o", out)
    assert "sides of 16" in refusal(capsys, "calibrate", points, "--size", "10x10", "-o", out)
    for length in ("-1", "0", "nan", "1000"):
        output = refusal(capsys, "calibrate", points, "--wand", length, "--size", "768x576", "-o", out)
        assert f"--wand {length}: expected" in output
    assert "no point takes its position" in refusal(
        capsys, "calibrate", points, "--court", "men", "--size", "768x576", "-o", out
    )
    assert not out.exists()


def test_a_folder_with_anything_but_a_run_is_left_alone(trial, capsys):
    before = {path.name: path.read_bytes() for path in trial.parent.iterdir() if path.is_file()}
    assert "is not empty and holds no run" in refusal(capsys, "track", trial, "-o", trial.parent)
    assert {path.name: path.read_bytes() for path in trial.parent.iterdir() if path.is_file()} == before


def test_a_folder_that_may_not_be_written_is_named_and_another_suggested(tmp_path, capsys, monkeypatch):
    def forbidden():
        raise PermissionError(13, "Permission denied", str(tmp_path / "summary.json.part"))

    monkeypatch.setattr("airborne.run.bench.measure_speed", forbidden)
    said = f"airborne: {tmp_path} cannot be written (Permission denied); give another folder with -o\n"
    assert refusal(capsys, "bench") == said


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["studo"], "No such command 'studo'. Did you mean 'studio'? See "),
        (["check", "--jsn"], "No such option: --jsn. Did you mean --json? See "),
        (["calibrate", "a.csv"], "Missing option '-o' / '--output': Calibration file to write"),
        (["check", "."], "(it is a folder); give the path of a trial's TOML file"),
    ],
)
def test_a_wrong_or_missing_word_is_answered_by_what_may_be_meant(capsys, words, says):
    assert says in refusal(capsys, *words)


def test_the_help_names_each_command_once_below_a_step_of_the_work(capsys):
    assert in_process("--help") == 0
    lines = capsys.readouterr().out.splitlines()
    named = [line.split()[0] for line in lines if line.startswith("  ") and not line.startswith((" " * 4, "  -"))]
    assert sorted(named[1:]) == sorted(vars(command_tree())["commands"])
    assert lines.index("Cameras:") < lines.index("Track:") < lines.index("Results:")
