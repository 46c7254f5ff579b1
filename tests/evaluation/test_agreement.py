"""Bias and limits of agreement hold what they promise, with repeated measures and in series of frames."""

import numpy as np
import pytest

from airborne.constants import NORMAL_QUANTILE_975
from airborne.evaluation import Series, analyse_agreement
from airborne.evaluation.agreement import effective_number, limits_of_agreement, variance_components
from airborne.evaluation.agreement_text import agreement_table
from tests.support.tolerances import ROUNDTRIP, sampled


def series(difference, individual=None, reference=None):
    reference = np.linspace(0, 100, len(difference)) if reference is None else reference
    who = np.full(len(difference), "one") if individual is None else np.asarray(individual, np.str_)
    return Series("x", "mm", np.stack([reference + difference, reference], axis=1), who)


def fading(rng, n, keep):
    steps, values = rng.normal(size=n), np.empty(n)
    values[0] = steps[0]
    for k in range(1, n):
        values[k] = keep * values[k - 1] + (1 - keep**2) ** 0.5 * steps[k]
    return values


def test_of_one_individual_without_correlation_it_is_mean_and_1_96_deviations():
    difference = np.random.default_rng(0).normal(2.0, 3.0, 500)
    spread = variance_components([difference], [500.0])
    low, high = limits_of_agreement(spread)
    assert spread.mean == pytest.approx(difference.mean(), abs=ROUNDTRIP)
    assert (high.value - low.value) / 2 == pytest.approx(1.959964 * difference.std(ddof=1), rel=1e-6)


def test_balanced_repeats_give_bland_and_altmans_variances():
    rng = np.random.default_rng(1)
    table = rng.normal(size=(12, 1)) + 0.5 * rng.normal(size=(12, 6))
    within = table.var(axis=1, ddof=1).mean()
    between = (6 * table.mean(axis=1).var(ddof=1) - within) / 6  # from the mean squares of the one-way analysis
    assert variance_components(list(table), [6.0] * 12).total == pytest.approx(between + within, rel=1e-12)


def test_limits_hold_95_of_100_differences_of_new_individuals():
    rng, held = np.random.default_rng(2), []
    for _ in range(60):
        own = [rng.normal(0.5, 2.0) + rng.normal(0, 1.0, m) for m in rng.integers(3, 12, 100)]
        low, high = limits_of_agreement(variance_components(own, [float(len(one)) for one in own]))
        new = rng.normal(0.5, 2.0, 200) + rng.normal(0, 1.0, 200)
        held.append(np.mean((new > low.value) & (new < high.value)))
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)


def test_intervals_of_bias_and_limits_hold_the_truth_in_95_of_100():
    rng, held = np.random.default_rng(3), []
    true = 0.5 + NORMAL_QUANTILE_975 * np.hypot(1.0, 0.7)
    for _ in range(400):
        own = [0.5 + rng.normal() + 0.7 * rng.normal(size=8) for _ in range(10)]
        who = np.repeat([f"player {k}" for k in range(10)], 8)
        result = analyse_agreement(series(np.concatenate(own), who))
        held.append([result.bias.low < 0.5 < result.bias.high, result.upper_limit.low < true < result.upper_limit.high])
    shares = np.mean(held, axis=0)
    assert shares.min() > 0.92 and shares.max() < 0.99  # short series count as a little fewer than they are


@pytest.mark.parametrize("keep", [0.0, 0.5, 0.8])
def test_frames_that_err_alike_count_as_fewer(keep):
    rng = np.random.default_rng(4)
    counts = [effective_number(fading(rng, 400, keep)) for _ in range(60)]
    assert np.mean(counts) == pytest.approx(400 * (1 - keep) / (1 + keep), rel=0.2)
    assert max(counts) <= 400


def test_the_bias_of_a_series_that_errs_alike_keeps_its_interval():
    rng = np.random.default_rng(5)
    held = [analyse_agreement(series(1.0 + fading(rng, 300, 0.7))).bias for _ in range(200)]
    assert np.mean([b.low < 1.0 < b.high for b in held]) > 0.88
    naive = [analyse_agreement(series(1.0 + rng.permutation(fading(rng, 300, 0.7)))).bias for _ in range(20)]
    assert np.mean([b.high - b.low for b in held]) > 1.8 * np.mean([b.high - b.low for b in naive])


def test_individuals_with_their_own_bias_widen_the_limits_and_the_interval_of_the_bias():
    rng = np.random.default_rng(6)
    who = np.repeat(list("abcd"), 50)
    own = np.repeat([-3.0, -1.0, 1.0, 3.0], 50) + rng.normal(size=200)
    apart, alike = analyse_agreement(series(own, who)), analyse_agreement(series(own))
    assert apart.n_individuals == 4
    assert apart.between_sd == pytest.approx(2.6, abs=0.3) and apart.within_sd == pytest.approx(1.0, abs=0.15)
    assert apart.bias.high - apart.bias.low > 5
    assert apart.upper_limit.value == pytest.approx(alike.upper_limit.value, rel=0.3)


def test_errors_come_with_their_range_and_reliability():
    rng = np.random.default_rng(17)
    result = analyse_agreement(series(1.0 + rng.normal(size=400)))
    assert result.rmse.value == pytest.approx(2**0.5, rel=0.1)
    assert result.rmse.low < 2**0.5 < result.rmse.high
    assert result.nrmse_percent.value == pytest.approx(result.rmse.value / result.range * 100)
    assert result.sem.value == pytest.approx(1 / 2**0.5, rel=3 * sampled(400))
    assert result.mdc.value == pytest.approx(1.959964 * 2**0.5 * result.sem.value)
    assert result.icc.consistency.value > result.icc.agreement.value > 0.99


def test_moments_without_a_number_are_left_out():
    difference = np.random.default_rng(8).normal(size=50)
    holed = difference.copy()
    holed[[3, 17]] = np.nan
    reference = np.arange(50.0)
    kept = np.delete(np.arange(50), [3, 17])
    assert analyse_agreement(series(holed, reference=reference)) == analyse_agreement(
        series(difference[kept], reference=reference[kept])
    )


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_any_moment_gives_what_it_can(n):
    result = analyse_agreement(series(np.arange(float(n)) + 2.0, reference=np.zeros(n)))
    assert result.n == n
    assert np.isnan(result.bias.value) == (n == 0)
    assert np.isnan(result.upper_limit.value) == (n < 2)
    assert np.isnan(result.nrmse_percent.value)


def test_of_single_measurements_of_several_individuals_the_limits_are_the_usual_ones():
    rng = np.random.default_rng(9)
    difference = rng.normal(size=12)
    result = analyse_agreement(series(difference, [f"jump {k}" for k in range(12)]))
    assert result.upper_limit.value - result.bias.value == pytest.approx(1.959964 * difference.std(ddof=1), rel=1e-6)
    assert np.isnan(result.within_sd)


def test_a_table_says_of_how_many_moments_it_is_and_where_they_are_few():
    rng = np.random.default_rng(8)
    few, many = (agreement_table([analyse_agreement(series(rng.normal(size=n)))]) for n in (3, 300))
    assert [text.splitlines()[1].split()[2] for text in (few, many)] == ["3", "300"]
    assert "few frames: these numbers are rough" in few and "few" not in many


def test_a_single_value_has_a_difference_and_no_limits():
    row = analyse_agreement(series(np.array([2.0])))
    assert row.bias.value == 2.0 and np.isnan([*row.lower_limit, *row.upper_limit]).all()
    head, line, *notes = agreement_table([row]).splitlines()
    assert len(line.split()) == len(head.replace("95 % limits", "limits").split()) + 1 and " to " not in line
    assert "of a single value" in notes[-1] and "no limits of agreement" in notes[-1]
