"""Tasks on Dask's scheduler: workers that die, addresses, and the table and page of what they leave."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from airborne.batch import cluster
from airborne.batch.cluster import do_tasks, open_client
from airborne.batch.run import Machines, run_batch
from airborne.batch.table import write_outputs
from airborne.batch.task import TaskOutcome
from airborne.batch.trials import BatchTrial, list_trials
from airborne.errors import AirborneError
from airborne.synthetic.throw.writing import write_trial
from tests.support import batch_work
from tests.support.broken_trials import WAYS
from tests.support.commands import in_process
from tests.support.places import ROOT
from tests.support.run_files import contents_of
from tests.support.synthetic import small_scene

pytestmark = pytest.mark.filterwarnings("default")  # those of Dask's own are not ours


@contextmanager
def started_dask(place):
    """A scheduler's address, with one worker, started as the docs say; and their processes."""
    file, command = place / "scheduler.json", [sys.executable, "-m", "dask"]
    here = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file), "--no-dashboard"]
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    quiet = {
        "cwd": place,
        "env": os.environ | {"PYTHONPATH": paths},
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
    }
    processes = [subprocess.Popen([*command, "scheduler", *here], **quiet)]
    worker = [*command, "worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-dashboard"]
    processes.append(subprocess.Popen(worker, **quiet))
    try:
        while not file.is_file():
            assert processes[0].poll() is None
            time.sleep(0.1)
        yield json.loads(file.read_text())["address"], processes
    finally:
        for process in reversed(processes):
            process.terminate()
        for process in processes:
            process.wait(60)


def ends(tmp_path, work, n=4, memory="auto"):
    tasks = batch_work.tasks(tmp_path, n)
    with open_client(None, 1, memory) as client:
        return {outcome.name: outcome for outcome in do_tasks(client, tasks, work=work)}


def test_a_worker_that_dies_costs_its_task_another_attempt(tmp_path):
    outcomes = ends(tmp_path, batch_work.die_once)
    assert {name: each.status for name, each in outcomes.items()} == {f"t000{k}": "done" for k in range(4)}
    assert len((tmp_path / "t0001").read_text().split()) == 2
    assert outcomes["t0000"].row == {"n_frames": 1}


def test_a_task_that_kills_every_worker_fails_alone(tmp_path, monkeypatch):
    monkeypatch.setitem(cluster._SETTINGS, "distributed.scheduler.allowed-failures", 1)
    outcomes = ends(tmp_path, batch_work.always_die, n=3)
    assert [outcomes[f"t000{k}"].status for k in range(3)] == ["done", "failed", "done"]
    assert "worker after worker died" in outcomes["t0001"].error


def test_a_task_that_takes_more_memory_than_declared_fails_alone(tmp_path, monkeypatch):
    monkeypatch.setitem(cluster._SETTINGS, "distributed.scheduler.allowed-failures", 1)
    outcomes = ends(tmp_path, batch_work.take_a_gigabyte, n=3, memory="600MB")
    assert [outcomes[f"t000{k}"].status for k in range(3)] == ["done", "failed", "done"]
    assert "give each more with --memory" in outcomes["t0001"].error


@pytest.mark.parametrize(
    ("memory", "said"),
    [
        ("much", "memory much: expected a size such as 4GB"),
        ("1MB", "a worker needs .* at least"),
        ("9PB", "2 workers of 9PB are more than the .* of this machine; give --workers 1, or less --memory"),
    ],
)
def test_memory_that_cannot_be_kept_is_one_line(memory, said):
    with pytest.raises(AirborneError, match=said), open_client(None, 2, memory):
        pass


def test_there_are_as_many_workers_as_memory_holds():
    assert cluster.count_workers("auto") >= cluster.count_workers("1GB") >= 1


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(cluster, "_CONNECT_S", 0.2)  # nobody answers: the time it takes is the time it waits


@pytest.mark.usefixtures("impatient")
def test_no_scheduler_at_an_address_is_one_line():
    with pytest.raises(AirborneError, match="no scheduler answers at tcp"), open_client("tcp://127.0.0.1:1", 1, "auto"):
        pass


@pytest.fixture(scope="module")
def season(tmp_path_factory):
    """A folder of two good trials and a broken one."""
    folder = tmp_path_factory.mktemp("season")
    write_trial(small_scene(is_interlaced=False, is_surveyed=False), folder / "good")
    for name in ("better", "broken"):
        shutil.copytree(folder / "good", folder / name)
    WAYS["body missing"](folder / "broken")
    return folder


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    with started_dask(tmp_path_factory.mktemp("dask")) as started:
        yield started


def test_a_batch_by_address_is_what_one_on_this_machine_is(dask, season, tmp_path, capsys):
    scheduler, _ = dask
    for name, where in (("here", ["--workers", 1]), ("there", ["--scheduler", scheduler])):
        assert in_process("batch", season, "-o", tmp_path / name, "--no-pictures", *where) == 1
    said = capsys.readouterr()
    assert said.out.count("2 tracked, 0 unchanged, 1 failed") == 2
    assert "cross.toml" in said.err
    here, there = (
        {name: data for name, data in contents_of(tmp_path / name).items() if not re.search("summary.json|logs/", name)}
        for name in ("here", "there")
    )
    assert here == there
    with (tmp_path / "here" / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["trial"], row["status"]) for row in rows] == [
        ("better", "done"),
        ("broken", "failed"),
        ("good", "done"),
    ]
    assert (
        in_process("batch", season, "-o", tmp_path / "there", "--no-pictures", "--scheduler", scheduler, "--json") == 1
    )
    answer = json.loads(capsys.readouterr().out)
    assert answer["counts"] == {"unchanged": 2, "failed": 1}
    assert in_process("batch", season, "-o", tmp_path / "there", "--no-pictures", "--dry-run") == 1
    assert "good: leave alone" in capsys.readouterr().out


def test_a_lost_scheduler_ends_a_batch_without_a_word_of_its_own(dask, tmp_path, capfd):
    """No other test has the scheduler after this one."""
    address, processes = dask
    with open_client(address, 1, "auto") as client:
        ended = []
        for outcome in do_tasks(client, batch_work.tasks(tmp_path, 400), work=batch_work.sleep_shortly):
            ended.append(outcome)
            if len(ended) == 3:
                processes[0].kill()
    assert 3 <= len(ended) < 400
    assert not [each for each in ended if each.error]
    assert "Traceback" not in capfd.readouterr().err


def test_a_dry_run_names_a_video_that_is_missing(season, tmp_path, capsys):
    shutil.copytree(season / "good", tmp_path / "trials" / "good")
    (tmp_path / "trials" / "good" / "cam2.mp4").unlink()
    assert in_process("batch", tmp_path / "trials", "-o", tmp_path / "out", "--dry-run") == 1
    assert re.match(r"good: cannot be tracked: .*cam2\.mp4", capsys.readouterr().out)


def test_a_dry_run_names_a_body_that_cannot_be_used(season, tmp_path, capsys):
    shutil.copytree(season / "good", tmp_path / "trials" / "good")
    body = tmp_path / "trials" / "good" / "cross.toml"
    body.write_text(re.sub(r"size_m = \[[^,]*", "size_m = [600.0", body.read_text(), count=1))
    assert in_process("batch", tmp_path / "trials", "-o", tmp_path / "out", "--dry-run") == 1
    assert re.match(r"good: cannot be tracked: .*is it in mm or cm", capsys.readouterr().out)


@pytest.mark.usefixtures("impatient")
def test_a_batch_that_cannot_start_exits_with_2(tmp_path, season, capsys):
    assert in_process("batch", tmp_path / "nothing", "-o", tmp_path / "out") == 2
    assert in_process("batch", season, "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:1") == 2
    assert capsys.readouterr().err.count("\n") == 2


def test_a_stopped_batch_says_what_was_not_tracked(tmp_path):
    trials = [BatchTrial(name, tmp_path / f"{name}.toml", {"athlete": "<b>anna"}) for name in ("a", "b")]
    write_outputs(tmp_path, trials, {"b": TaskOutcome("b", "done", row={"n_frames": 3, "share_tracked": 1.0})})
    with (tmp_path / "trials.csv").open() as file:
        first, second = csv.DictReader(file)
    assert (first["status"], second["status"], second["n_frames"]) == ("not run", "done", "3")
    assert "the batch was stopped" in first["error"]
    page = (tmp_path / "index.html").read_text()
    assert "2 trials, 1 not run" in page
    assert "<b>anna" not in page and "&lt;b&gt;anna" in page
    assert "http" not in page, "it needs no network"


def test_a_batch_that_is_stopped_before_any_trial_is_done_leaves_its_table(season, tmp_path, monkeypatch):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.batch.run.do_tasks", stop)
    with pytest.raises(KeyboardInterrupt):
        run_batch(list_trials(str(season)), tmp_path, machines=Machines(workers=1))
    with (tmp_path / "trials.csv").open() as file:
        assert {row["status"] for row in csv.DictReader(file)} == {"not run"}


def test_two_batches_do_not_write_into_one_folder(season, tmp_path):
    from airborne.io.folder_lock import sole_writer

    with sole_writer(tmp_path), pytest.raises(AirborneError, match="being written by another"):
        run_batch(list_trials(str(season)), tmp_path)
