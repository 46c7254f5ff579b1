"""Figures of an analysis are written for whatever there is to draw."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from airborne.evaluation import Series, analyse_agreement
from airborne.export.analysis_figures import format_limits, write_bland_altman, write_identity, write_residuals
from airborne.motion.jumps.jump import Measurement
from airborne.motion.smoothing import residual_analysis

BIAS_GREY = (51, 51, 51)


def make_variables(n_variables, n=40, sd=1.0):
    rng, result = np.random.default_rng(0), []
    for k in range(n_variables):
        reference = np.linspace(0, 100, n)
        values = np.stack([reference + sd * rng.normal(size=n), reference], axis=1)
        series = Series(f"variable {k}", "mm", values, np.where(np.arange(n) % 2, "one", "two"))
        result.append((series, analyse_agreement(series)))
    return result


@pytest.mark.parametrize("n_variables", [1, 3, 7])
@pytest.mark.parametrize("write", [write_bland_altman, write_identity])
def test_there_is_a_panel_for_each_variable(tmp_path, write, n_variables):
    write(tmp_path / "few.png", make_variables(n_variables))
    with Image.open(tmp_path / "few.png") as picture:
        pixels = np.asarray(picture.convert("L"))
    columns = min(3, n_variables)
    rows = -(-n_variables // columns)
    assert pixels.shape[0] == rows * 375
    panels = [block for row in np.split(pixels, rows) for block in np.array_split(row, columns, axis=1)]
    assert [bool((block < 200).mean() > 0.01) for block in panels] == [k < n_variables for k in range(columns * rows)]


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("sd", [0.0, 1.0])
def test_hardly_anything_is_drawn_too(tmp_path, n, sd):
    write_bland_altman(tmp_path / "a.png", make_variables(1, n, sd))
    write_identity(tmp_path / "b.png", make_variables(1, n, sd))
    assert (tmp_path / "a.png").stat().st_size > 5000


def test_residuals_are_drawn_with_and_without_a_cutoff_used(tmp_path):
    t = np.arange(200) / 60
    noise = 0.01 * np.random.default_rng(1).normal(size=(200, 1, 1))
    result = residual_analysis(t, np.sin(6 * t)[:, None, None] + noise)
    write_residuals(tmp_path / "a.png", result)
    write_residuals(tmp_path / "b.png", result, 3.0)
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ((-0.00328, -0.217, 0.21), "0.00 [−0.22, 0.21] mm"),
        ((1.5, -30.0, 33.0), "2 [−30, 33] mm"),
        ((0.0, 0.0, 0.0), "0.00 [0.00, 0.00] mm"),
        ((-1.5, np.nan, np.nan), "−1.50 mm, no limits"),
    ],
)
def test_limits_have_equally_many_decimals_and_a_true_minus(numbers, text):
    _, row = make_variables(1)[0]
    bias, low, high = (Measurement(value, value, value) for value in numbers)
    assert format_limits(replace(row, bias=bias, lower_limit=low, upper_limit=high)) == text
