"""One trial of a batch: tracked once, resumed, tracked again when changed; what is wrong with it is one line."""

import re
import shutil
from pathlib import Path

import pytest

from airborne.batch.row import row_of
from airborne.batch.task import Task, do_task, inspect_folder
from airborne.batch.trials import list_trials
from airborne.run.track import track_trial
from airborne.synthetic.throw.writing import write_trial
from airborne.trial.file import read_trial
from tests.support.broken_trials import WAYS
from tests.support.run_files import contents_of
from tests.support.synthetic import small_scene

WITH_TIMES = ("summary.json", "report.html")


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """The folder of a small trial."""
    folder = tmp_path_factory.mktemp("good") / "throw"
    write_trial(small_scene(is_interlaced=False, is_surveyed=False), folder)
    return folder


def task_of(folder, out, *, pictures=False):
    (trial,) = list_trials(str(folder))
    return Task(trial, out, pictures)


def same_results(first: Path, second: Path):
    ours, theirs = (
        {name: data for name, data in contents_of(folder).items() if name not in WITH_TIMES}
        for folder in (first, second)
    )
    return ours == theirs


def test_a_task_leaves_what_a_single_run_leaves(good, tmp_path):
    reports = []
    outcome = do_task(task_of(good, tmp_path / "out"), lambda *each: reports.append(each))
    track_trial(read_trial(good / "trial.toml"), tmp_path / "single", pictures=False)
    assert (outcome.name, outcome.status, outcome.error) == ("throw", "done", "")
    assert same_results(tmp_path / "out" / "throw", tmp_path / "single")
    assert reports[0][0] == "throw"
    log = (tmp_path / "out" / "logs" / "throw.log").read_text()
    assert "new\n" in log and "done after" in log
    assert outcome.row == row_of(tmp_path / "single")
    assert outcome.row["share_lost"] == 0


def test_only_what_is_missing_or_changed_is_tracked(good, tmp_path):
    folder = tmp_path / "throw"
    shutil.copytree(good, folder)
    task = task_of(folder, tmp_path / "out")
    assert [do_task(task).status for _ in range(2)] == ["done", "unchanged"]
    assert inspect_folder(task_of(folder, tmp_path / "out", pictures=True), read_trial(task.trial.path))[0] == "stopped"
    (tmp_path / "out" / "throw" / "summary.json").unlink()
    assert inspect_folder(task, read_trial(task.trial.path))[0] == "stopped"
    text = (folder / "trial.toml").read_text()
    (folder / "trial.toml").write_text(text.replace("stop = 4", "stop = 3"))
    assert inspect_folder(task, read_trial(task.trial.path))[0] == "changed"
    again = do_task(task)
    assert (again.status, again.row["n_frames"]) == ("done", 3)


def test_a_changed_trial_that_cannot_be_tracked_fails_each_time_and_never_passes_off_the_old_run_as_its_own(
    good, tmp_path
):
    folder = tmp_path / "throw"
    shutil.copytree(good, folder)
    task = task_of(folder, tmp_path / "out")
    do_task(task)
    text = (folder / "trial.toml").read_text()
    (folder / "trial.toml").write_text(
        re.sub(r"\[start\].*(?=\[track\])", "", text, flags=re.DOTALL)
    )  # 4 frames are too few
    assert [do_task(task).status for _ in range(2)] == ["failed", "failed"]
    assert inspect_folder(task, read_trial(task.trial.path))[0] == "changed"
    assert row_of(task.folder)["n_frames"] == 4  # what was there stays until there is something else
    (folder / "trial.toml").write_text(text.replace("stop = 4", "stop = 3"))
    again = do_task(task)
    assert (again.status, again.row["n_frames"]) == ("done", 3)
    assert do_task(task).status == "unchanged"


def test_a_stopped_run_goes_on_to_the_same_bytes(good, tmp_path):
    task = task_of(good, tmp_path / "out")
    do_task(task)
    first = contents_of(task.folder)
    rows = (task.folder / "motion.csv").read_text().splitlines(keepends=True)
    (task.folder / "motion.csv").write_text("".join(rows[:3]))
    (task.folder / "summary.json").unlink()
    (task.folder / "lasting.bin").unlink(missing_ok=True)
    assert do_task(task).status == "done"
    assert "stopped" in task.log.read_text()
    again = contents_of(task.folder)
    assert again["motion.csv"] == first["motion.csv"]


@pytest.mark.parametrize("way", WAYS)
def test_a_broken_trial_is_one_line(good, tmp_path, way):
    folder = tmp_path / "throw"
    shutil.copytree(good, folder)
    WAYS[way](folder)
    outcome = do_task(task_of(folder, tmp_path / "out"))
    assert outcome.status == "failed"
    assert outcome.error and "\n" not in outcome.error
    assert "unexpected" not in outcome.error
    assert outcome.error in task_of(folder, tmp_path / "out").log.read_text()


def test_another_version_on_a_worker_is_one_line(good, tmp_path):
    (trial,) = list_trials(str(good))
    outcome = do_task(Task(trial, tmp_path, pictures=False, version="0.0.1"))
    assert "install the same on every machine" in outcome.error


def test_a_run_that_another_writes_is_left_alone(good, tmp_path):
    task = task_of(good, tmp_path / "out")
    task.folder.mkdir(parents=True)
    (task.folder / "mine.txt").write_text("not a run")
    assert "holds no run" in do_task(task).error


def test_a_thumbnail_is_made_of_a_runs_figures(good, tmp_path):
    task = task_of(good, tmp_path / "out", pictures=True)
    do_task(task)
    assert (tmp_path / "out" / "thumbnails" / "throw.jpg").stat().st_size > 500
    assert do_task(task).status == "unchanged"
