"""One writer a folder: a second one is refused while the first holds the lock, and never after it."""

import errno
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from airborne.errors import ResultError
from airborne.io.folder_lock import LOCK, find_writer, refuse_links, sole_writer

HOLD = """
import sys, time
from pathlib import Path
from airborne.io.folder_lock import sole_writer
with sole_writer(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the lock of the folder `run`."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "run")], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"held\n"
    yield process
    process.kill()
    process.communicate()


def test_the_second_writer_is_told_who_the_first_is(holder, tmp_path):
    with pytest.raises(ResultError, match=f"being written by another run .process {holder.pid} on ") as caught:
        sole_writer(tmp_path / "run").__enter__()
    assert "\n" not in str(caught.value)
    assert "if that machine is down" not in str(caught.value)


def test_a_lock_of_another_machine_says_what_to_do_when_it_is_stale(holder, tmp_path):
    (tmp_path / "run" / LOCK).write_text("process 1 on elsewhere since 2026-01-01 10:00:00")
    with pytest.raises(ResultError, match=r"if that machine is down, remove run\.lock"):
        sole_writer(tmp_path / "run").__enter__()


def test_the_lock_is_gone_with_its_process_however_it_ends(holder, tmp_path):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / "run" / LOCK).exists()
    with sole_writer(tmp_path / "run"):
        assert f"process {os.getpid()} on " in (tmp_path / "run" / LOCK).read_text()
    assert not (tmp_path / "run" / LOCK).exists()


def test_a_process_that_ended_unnoticed_writes_no_more(holder, tmp_path):
    assert find_writer(tmp_path / "run") == holder.pid
    holder.kill()
    while Path(f"/proc/{holder.pid}/stat").read_text().split()[2] != "Z":  # as long as nobody waits for it
        time.sleep(0.01)
    assert find_writer(tmp_path / "run") is None


def test_a_folder_that_is_removed_while_it_is_looked_at_is_made_anew(tmp_path, monkeypatch):
    make, tries = Path.mkdir, []

    def make_late(path, *arguments, **options):
        tries.append(path)
        if len(tries) == 1:
            raise FileExistsError(errno.EEXIST, "File exists", str(path))  # and it is gone by now
        make(path, *arguments, **options)

    monkeypatch.setattr(Path, "mkdir", make_late)
    with sole_writer(tmp_path / "run"):
        assert tries == [tmp_path / "run"] * 2


def test_what_is_no_folder_is_not_waited_for(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for path in ("file", "file/run", "link", "link/run"):
        with pytest.raises((OSError, ResultError), match=r"link|file"):
            sole_writer(tmp_path / path).__enter__()


def test_two_of_one_process_are_two_writers(tmp_path):
    with sole_writer(tmp_path / "run"), pytest.raises(ResultError, match="another run"):
        sole_writer(tmp_path / "run").__enter__()


def test_only_one_writes_at_a_time_however_many_come_and_go(tmp_path):
    writing, most = [], []

    def write(k):
        try:
            with sole_writer(tmp_path / "run"):
                writing.append(k)
                most.append(len(writing))
                writing.remove(k)
        except ResultError:
            return 0
        return 1

    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(write, range(2000))) > 0
    assert max(most) == 1


def test_a_link_that_leads_out_of_the_folder_is_refused(tmp_path):
    (tmp_path / "run" / "tables").mkdir(parents=True)
    (tmp_path / "run" / "inside").symlink_to("tables")
    refuse_links(tmp_path / "run")
    (tmp_path / "run" / "tables" / "angles.csv").symlink_to(tmp_path / "mine")
    with pytest.raises(ResultError, match=r"angles.csv is a link that leads out of"):
        refuse_links(tmp_path / "run")


def test_whatever_finds_no_room_in_the_folder_is_told_as_a_full_disk(tmp_path):
    expected = rf"{tmp_path}/run cannot be written \(No space left on device\): \d+ MB are free"
    with pytest.raises(ResultError, match=expected), sole_writer(tmp_path / "run"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
