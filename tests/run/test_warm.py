"""After `airborne warm` the first run compiles nothing."""

import os
import subprocess
import sys

from airborne.trial.examples import example_trial

AIRBORNE = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"


def airborne(*words):
    return subprocess.run(
        [sys.executable, "-c", AIRBORNE, *words], env=dict(os.environ), capture_output=True, text=True, check=True
    )


def test_what_was_warmed_compiles_nothing(tmp_path):
    assert "kernels are ready" in airborne("warm").stdout
    done = airborne("track", str(example_trial("thrown_cross")), "-o", str(tmp_path / "run"), "--no-pictures")
    assert "compiling" not in done.stderr
