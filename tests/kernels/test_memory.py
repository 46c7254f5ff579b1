"""Frames take their memory from what earlier frames left."""

import os
import subprocess
import sys

import pytest

# ten frames of three arrays of 4 MB each; prints the page faults of the last nine
_FRAMES = """
import resource
import numpy as np
{first}

def frame():
    for array in [np.empty(1 << 20, np.float32) for _ in range(3)]:
        array[:] = 1.0

frame()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(9):
    frame()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(first: str) -> int:
    words = [sys.executable, "-c", _FRAMES.format(first=first)]
    env = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}  # Dask leaves one
    return int(subprocess.run(words, env=env, check=True, capture_output=True, text=True).stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other allocators than glibc's")
def test_later_frames_take_no_new_pages_from_the_system():
    n_pages = 9 * 3 * (4 << 20) // 4096
    assert faults("import airborne.kernels") < n_pages / 100
