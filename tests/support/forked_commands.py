"""The commands that a studio starts, as forks of the process that has imported everything: no test is of the import."""

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace
from typing import IO, Any

from airborne.cli import main
from airborne.studio import commands

FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload(["airborne.cli", "airborne.studio.server", "tests.support.studio_ready"])
_RUN = commands._RUN  # the code of the command line


class ForkedCommand:
    """What `subprocess.Popen` is to a studio's command: its words are those after the code of the command line."""

    def __init__(
        self, words: Sequence[str], *, cwd: Path, stdin: int, stdout: int, stderr: IO, env: Mapping[str, str]
    ) -> None:
        ours, out = FORKS.Pipe(duplex=False)
        arguments = (tuple(words[3:]), cwd, out, Path(stderr.name), dict(env))
        self._process = FORKS.Process(target=_run_words, args=arguments)
        self._process.start()
        out.close()
        self.stdout = os.fdopen(os.dup(ours.fileno()), "rb")
        ours.close()

    def poll(self) -> int | None:
        return self._process.exitcode

    def terminate(self) -> None:
        self._process.terminate()

    def kill(self) -> None:
        self._process.kill()

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if (code := self._process.exitcode) is None:
            raise subprocess.TimeoutExpired(self._process.name, timeout or 0.0)
        return code


def fork_commands() -> None:
    """Let the commands of this process's studio be forks, but for those whose code a test has replaced."""
    forkserver._forkserver.ensure_running = lambda: None  # it runs; Python starts each fork another, which imports all
    commands.subprocess = FORKED


def _start(words: Sequence[str], **options: Any) -> Any:
    return (ForkedCommand if words[2] == _RUN else subprocess.Popen)(words, **options)


FORKED = SimpleNamespace(**vars(subprocess) | {"Popen": _start})  # what `subprocess` is to the studio's commands


def _run_words(words: tuple[str, ...], folder: Path, out: Connection, log: Path, env: Mapping[str, str]) -> None:
    with log.open("ab") as errors, open(os.devnull) as nothing:
        for number, file in enumerate((nothing, out, errors)):
            os.dup2(file.fileno(), number)
    out.close()
    os.chdir(folder)
    os.environ.update(env)
    sys.argv = ["airborne", *words]
    main()
