"""After `airborne warm` the first run compiles nothing."""

import os
import shutil
import subprocess
import sys

from airborne.trial.examples import example_trial
from tests.support.example_trial import LONG, edit_trial

AIRBORNE = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"


def airborne(*words):
    return subprocess.run(
        [sys.executable, "-c", AIRBORNE, *words], env=dict(os.environ), capture_output=True, text=True, check=True
    )


def test_what_was_warmed_compiles_nothing(tmp_path):
    assert "kernels are ready" in airborne("warm").stdout
    folder = tmp_path / "trial"
    shutil.copytree(example_trial("thrown_cross").parent, folder)
    short = edit_trial(folder / "trial.toml", "short.toml", ("[track]", f"[track]\nstop = {LONG}"))
    done = airborne("track", str(short), "-o", str(tmp_path / "run"), "--no-pictures")
    assert "compiling" not in done.stderr
