"""Commands that the studio starts, each a process of its own, and runs that were started elsewhere."""

import subprocess
import sys
from fractions import Fraction

from airborne.cameras import Rig, camera_looking_at
from airborne.io.folder_lock import LOCK
from airborne.motion.run_folder import SUMMARY
from airborne.studio import commands
from airborne.studio.commands import Command
from airborne.studio.session import Session
from tests.support.forked_commands import FORKED
from tests.support.person_run import write_person_run

_WRITES = """
import pathlib, signal, sys, time
from airborne.io.folder_lock import sole_writer
signal.signal(signal.SIGTERM, signal.default_int_handler)
with sole_writer(pathlib.Path(sys.argv[1])):
    print("writes", flush=True)
    time.sleep(600)
"""


def test_two_commands_of_one_kind_say_each_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(commands, "subprocess", FORKED)
    exports = [Command(["export", name, "--c3d"], tmp_path) for name in ("no_run", "no_other")]
    for command in exports:
        assert command.output() == ""
        command._process.wait()
    assert ["no_run" in each.complaint() for each in exports] == [True, False]
    assert "no_other" in exports[1].complaint()
    exports[0]._log.write_text("airborne: compiling\ntracking cross: a throw: 3 of 34\n")
    assert (exports[0].how_far(), exports[0].n_done()) == ("3 of 34", 3)
    exports[0]._log.write_text("looking for the start: 30 of 34\n")
    assert (exports[0].how_far(), exports[0].n_done()) == ("30 of 34", 0)  # none of these is tracked
    exports[0]._log.write_text("airborne: compiling: up to a minute\n")
    assert (exports[0].how_far(), exports[0].n_done()) == ("compiling: up to a minute", 0)


def test_a_command_says_from_the_first_moment_what_it_does_and_how_far_it_is(tmp_path):
    write_person_run(
        tmp_path / "results",
        Rig((camera_looking_at("a", [3, -4, 1], [0, 0, 1], focal_px=300, size=(320, 240)),)),
        12,
        Fraction(50),
    )
    command = Command(["export", "results", "--trc"], tmp_path)
    assert "results.trc" in command.output()
    command._process.wait()
    assert (command.code, command.progress()) == (0, "writing trc: 0 of 1")


def test_a_run_that_a_killed_studio_left_is_found_again_and_can_be_stopped(tmp_path):
    assert Session(tmp_path, tmp_path / "trial.toml").commands == {}
    run = tmp_path / "results"
    with subprocess.Popen([sys.executable, "-c", _WRITES, str(run)], stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        command = Session(tmp_path, tmp_path / "trial.toml").commands["track"]
        assert command.is_running and not command.is_own
        assert command.line == "airborne track trial.toml -o results"
        assert 0 <= command.seconds < 600
        command.stop()
        assert process.wait() != 0
    assert (command.is_running, command.code) == (False, 1)
    assert command.complaint() == "it ended early; go on"
    assert not run.exists()  # as nothing was written
    run.mkdir()
    (run / SUMMARY).touch()
    with subprocess.Popen([sys.executable, "-c", _WRITES, str(run)], stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()  # something is added to a run that is finished
        assert Session(tmp_path, tmp_path / "trial.toml").commands == {}
        process.kill()
    assert (command.code, command.output()) == (0, "ended\n")
    (run / LOCK).write_text("process 999999999 on another since 2026-01-01 00:00:00")
    assert Session(tmp_path, tmp_path / "trial.toml").commands == {}
