"""Benchmarks know which of their rows are older than what they measure, and how cost grows."""

import subprocess
import sys

import numpy as np
import pytest

from benchmarks.rows import changes_since
from benchmarks.speed import scaling
from benchmarks.speed.scaling import exponent, main
from tests.support.synthetic import small_scene


def git(folder, *words):
    identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
    return subprocess.run(["git", *identity, *words], cwd=folder, check=True, capture_output=True, text=True).stdout


def commit(folder, path, text):
    (folder / path).parent.mkdir(exist_ok=True)
    (folder / path).write_text(text)
    git(folder, "add", ".")
    git(folder, "commit", "-qm", text)
    return git(folder, "rev-parse", "--short", "HEAD").strip()


def test_a_row_is_older_than_changes_of_what_it_measures_only(tmp_path):
    git(tmp_path, "init", "-q")
    first = commit(tmp_path, "video/a.py", "one")
    commit(tmp_path, "docs/a.md", "two")
    assert changes_since(first, ["video"], tmp_path) == 0
    commit(tmp_path, "video/a.py", "three")
    assert changes_since(first, ["video"], tmp_path) == 1
    assert changes_since("0123abc", ["video"], tmp_path) is None


@pytest.mark.parametrize("power", [0.8, 1.0, 1.2])
def test_an_exponent_is_found_beside_a_fixed_cost(power):
    n = np.array([34.0, 68, 136, 272])
    assert exponent(n, 0.9 + 0.01 * n**power, has_fixed_cost=True) == pytest.approx(power, abs=0.02)
    assert exponent(n, 0.01 * n**power, has_fixed_cost=False) == pytest.approx(power)


def test_the_scaling_benchmark_runs(monkeypatch, capsys):
    monkeypatch.setattr(scaling, "cross_scene", lambda seed: small_scene())
    monkeypatch.setattr(sys, "argv", ["scaling.py", "--quick", "--only", "picture"])
    main()
    assert "exponent" in capsys.readouterr().out
