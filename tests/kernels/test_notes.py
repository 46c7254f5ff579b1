"""A run that compiles says so in one line; one that finds everything compiled says nothing."""

import os
import subprocess
import sys

CALL = """
from airborne.cli.console import show_notes
show_notes()
import numpy as np
from airborne.geometry.joint_rotations import motion_between
motion_between(np.eye(4), np.eye(4))
motion_between(np.eye(4)[:, ::-1], np.eye(4))  # other types of arguments: compiled for themselves
"""


def test_compiling_is_told_once_and_only_where_it_happens(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    for expected in (1, 0):
        done = subprocess.run([sys.executable, "-c", CALL], env=environment, capture_output=True, text=True, check=True)
        lines = [line for line in done.stderr.splitlines() if "compiling" in line]
        assert len(lines) == expected
        assert all("minute" in line for line in lines)
