"""Over a thousand random and mutated files: every reader says what is wrong in one line, or reads them."""

import json
import os
import subprocess
import sys

import pytest

from tests.support.any_input import CPU_LIMIT_S, MEMORY_LIMIT_BYTES
from tests.support.places import ROOT

N_FILES = 1200  # a seed; more: AIRBORNE_FUZZ_SECONDS
SEED, SECONDS = (os.environ.get(f"AIRBORNE_FUZZ_{word}", "0") for word in ("SEED", "SECONDS"))
CPU_LIMIT_ALL_S = 120.0 + 2 * float(SECONDS)  # it takes 20 s on two cores of 2020


@pytest.fixture(scope="module")
def found():
    """What came of feeding the files, in a process of its own, whose memory is limited."""
    threads = {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "tests.support.any_input",
            "--files",
            str(N_FILES),
            "--seed",
            SEED,
            "--seconds",
            SECONDS,
        ],
        **{
            "cwd": ROOT,
            "env": os.environ | threads,
            "capture_output": True,
            "text": True,
            "timeout": 1800 + 2 * float(SECONDS),
        },
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


def test_no_file_brings_anything_but_one_clear_line(found):
    assert found["failures"] == {}


def test_every_reader_saw_its_share(found):
    assert sum(found["files"].values()) >= N_FILES
    assert min(found["files"].values()) >= 8
    assert len(found["files"]) >= 40


def test_no_file_takes_long(found):
    assert max(cpu_s for cpu_s, _ in found["slowest"].values()) < CPU_LIMIT_S
    assert found["cpu_s"] < CPU_LIMIT_ALL_S


def test_no_file_takes_much_memory(found):
    assert found["grown_mb"] < MEMORY_LIMIT_BYTES / 1e6
