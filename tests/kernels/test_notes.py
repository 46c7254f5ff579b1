"""A run that compiles says so in one line; one that finds everything compiled says nothing."""

import subprocess
import sys

CALL = """
import os
from airborne.cli.console import show_notes
show_notes()
import numpy as np
from airborne.geometry.joint_rotations import motion_between
motion_between(np.eye(4), np.eye(4))
motion_between(np.eye(4)[:, ::-1], np.eye(4))
"""


def notes(cache, environment):
    done = subprocess.run([sys.executable, "-c", CALL], env=environment, capture_output=True, text=True, check=True)
    return [line for line in done.stderr.splitlines() if "compiling" in line]


def test_compiling_is_told_once_and_only_where_it_happens(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    import os

    first, second = (notes(tmp_path, dict(os.environ)) for _ in range(2))
    assert len(first) == 1 and "minute" in first[0]
    assert second == []
