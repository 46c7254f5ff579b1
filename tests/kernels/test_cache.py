"""Kernels are cached by what they were compiled from, and give the same bytes just compiled or loaded."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src"

INNER = """
from airborne.kernels import kernel
from constants import OFFSET

@kernel
def inner(x):
    return 2 * x + OFFSET
"""
OUTER = """
from airborne.kernels import kernel
from inner import inner

@kernel
def outer(x):
    return inner(x) + 1

@kernel
def alone(x):
    return 5 * x
"""
CALL = """
from outer import alone, outer
print(outer(10), alone(1), sum(outer.stats.cache_hits.values()), sum(alone.stats.cache_hits.values()))
"""
LONG = "\n".join(f"        total += row[k] * weights[k] / ({n}.5 + total * weights[{n}])" for n in range(60))
ROWS = f"""
from airborne.kernels import kernel

@kernel(fastmath=True)
def row_sum(row, weights):
    total = 0.0
    for k in range(len(row)):
{LONG}
    return total

@kernel(fastmath=True)
def add_rows(table, weights, sums):
    for i in range(len(table)):
        sums[i] += row_sum(table[i], weights)
"""
SUMS = """
import hashlib
import sys

import numpy as np

from airborne.kernels import kernel
from rows import add_rows

@kernel(fastmath=True)
def through_a_caller(table, weights, sums):
    return add_rows(table, weights, sums)

rng = np.random.default_rng(0)
table, weights, sums = rng.normal(size=(60, 401)), rng.random(401), np.zeros(60)
(add_rows if sys.argv[1] == "directly" else through_a_caller)(table, weights, sums)
print(hashlib.sha256(sums.tobytes()).hexdigest())
"""


def run(code, cache, *args, folder=Path()):
    paths = os.pathsep.join([str(SOURCE), str(folder)])
    env = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    env.pop("NUMBA_CACHE_DIR", None)
    if cache is not None:
        env["NUMBA_CACHE_DIR"] = str(cache)
    Path(folder, "main.py").write_text(code)
    done = subprocess.run([sys.executable, Path(folder, "main.py"), *args], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.fixture
def kernels(tmp_path):
    (tmp_path / "constants.py").write_text("OFFSET = 3\n")
    (tmp_path / "inner.py").write_text(INNER)
    (tmp_path / "outer.py").write_text(OUTER)
    return tmp_path


def cached(folder):
    return sorted(path.name.split("-")[0] for path in folder.rglob("*.nbc"))


def test_an_edit_in_another_file_compiles_what_calls_it_anew_and_nothing_else(kernels):
    assert run(CALL, None, folder=kernels) == ["24", "5", "0", "0"]
    assert run(CALL, None, folder=kernels) == ["24", "5", "1", "1"]
    (kernels / "inner.py").write_text(INNER.replace("2 * x", "7 * x"))
    assert run(CALL, None, folder=kernels) == ["74", "5", "0", "1"]
    (kernels / "constants.py").write_text("OFFSET = 4\n")
    assert run(CALL, None, folder=kernels) == ["75", "5", "0", "1"]
    assert cached(kernels / "__pycache__") == ["inner.inner", "outer.alone", "outer.outer"]  # one state of each


def test_a_damaged_file_is_compiled_anew_in_the_folder_that_the_user_names(kernels, tmp_path):
    run(CALL, tmp_path / "chosen", folder=kernels)
    assert cached(tmp_path / "chosen") == cached(tmp_path) == ["inner.inner", "outer.alone", "outer.outer"]
    for path in tmp_path.rglob("*.nbc"):
        path.write_bytes(path.read_bytes()[:100])
    assert run(CALL, tmp_path / "chosen", folder=kernels) == ["24", "5", "0", "0"]


def test_just_compiled_or_loaded_a_kernel_under_fast_maths_gives_the_same_bytes(tmp_path):
    (tmp_path / "rows.py").write_text(ROWS)
    cold = run(SUMS, tmp_path / "a", "through a caller", folder=tmp_path)
    assert run(SUMS, tmp_path / "a", "through a caller", folder=tmp_path) == cold
    run(SUMS, tmp_path / "b", "directly", folder=tmp_path)
    assert run(SUMS, tmp_path / "b", "through a caller", folder=tmp_path) == cold
