"""Intraclass correlations: the published worked example, and what they mean."""

import numpy as np
import pandas as pd
import pytest

from airborne.evaluation import reliability
from airborne.evaluation.icc import mean_squares
from tests.conftest import imported
from tests.support.tolerances import ROUNDTRIP

# Shrout and Fleiss 1979, table 2: six targets, four judges
JUDGES = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float)
# value and 95 % interval, as printed by the R package psych (ICC) and by pingouin for the same table
PUBLISHED = {
    "one_way": (0.17, -0.13, 0.72),
    "agreement": (0.29, 0.02, 0.76),
    "consistency": (0.71, 0.34, 0.95),
    "one_way_mean": (0.44, -0.88, 0.91),
    "agreement_mean": (0.62, 0.07, 0.93),
    "consistency_mean": (0.91, 0.68, 0.99),
}


@pytest.mark.parametrize("model", PUBLISHED)
def test_the_worked_example_of_shrout_and_fleiss_is_reproduced(model):
    assert tuple(getattr(reliability(JUDGES), model)) == pytest.approx(PUBLISHED[model], abs=0.006)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
@pytest.mark.parametrize(("n", "k", "bias"), [(6, 4, 0.0), (15, 3, 0.8), (40, 2, 2.0)])
def test_values_and_intervals_are_those_of_pingouin(n, k, bias, monkeypatch):
    pingouin = imported("pingouin")
    monkeypatch.setitem(pingouin.options, "round.column.CI95", 12)
    rng = np.random.default_rng(n)
    ratings = rng.normal(size=(n, 1)) + 0.7 * rng.normal(size=(n, k)) + bias * np.arange(k)
    target, method = np.indices((n, k)).reshape(2, -1)
    table = pd.DataFrame({"target": target, "method": method, "rating": ratings.ravel()})
    theirs = pingouin.intraclass_corr(table, "target", "method", "rating").set_index("Type")
    for model, name in zip(PUBLISHED, ("1,1", "A,1", "C,1", "1,k", "A,k", "C,k"), strict=True):
        expected = (theirs.loc[f"ICC({name})", "ICC"], *theirs.loc[f"ICC({name})", "CI95"])
        assert tuple(getattr(reliability(ratings), model)) == pytest.approx(expected, abs=1e-9)


def test_mean_squares_are_those_of_the_published_table():
    assert mean_squares(JUDGES) == pytest.approx((11.24, 32.49, 1.02, 6.26), abs=0.006)
    assert reliability(JUDGES).sem.value == pytest.approx(1.02**0.5, abs=0.003)


def test_a_bias_between_the_ways_costs_agreement_and_no_consistency():
    rng = np.random.default_rng(0)
    ratings = rng.normal(size=(50, 1)) + 0.1 * rng.normal(size=(50, 2))
    shifted = reliability(ratings + np.array([0.0, 1.0]))
    assert shifted.consistency.value == pytest.approx(reliability(ratings).consistency.value, abs=ROUNDTRIP)
    assert shifted.agreement.value < 0.75 < 0.98 < shifted.consistency.value


def test_intervals_hold_the_truth_in_95_of_100():
    rng, held = np.random.default_rng(1), []
    for _ in range(400):
        result = reliability(2.0 * rng.normal(size=(15, 1)) + rng.normal(size=(15, 3)))
        held.append([low <= 0.8 <= high for _, low, high in (result.one_way, result.agreement, result.consistency)])
    assert np.mean(held, axis=0) == pytest.approx([0.95] * 3, abs=0.03)


def test_fewer_effective_targets_widen_the_intervals_alone():
    whole, part = reliability(JUDGES), reliability(JUDGES, 4.0)
    assert part.agreement.value == whole.agreement.value
    assert part.agreement.low < whole.agreement.low and part.sem.high > whole.sem.high


@pytest.mark.parametrize("ratings", [np.zeros((0, 2)), np.zeros((1, 2)), np.zeros((9, 1)), np.ones((9, 2))])
def test_what_is_undetermined_is_unknown(ratings):
    assert np.isnan(reliability(ratings).agreement.value)


def test_perfect_agreement_is_one():
    ratings = np.repeat(np.arange(5.0)[:, None], 2, axis=1)
    assert reliability(ratings).consistency.value == reliability(ratings).agreement.value == 1.0
