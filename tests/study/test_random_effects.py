"""Differences of conditions from several trials of several athletes: laws, special cases, how often they are right."""

import numpy as np
import pytest
from scipy.stats import norm, ttest_ind, ttest_rel

from airborne.study.comparison import adjust_holm
from airborne.study.random_effects import Cells, estimate_difference, pool, within_spread
from tests.support.tolerances import EXACT, ROUNDTRIP

RUNS, NODES = 400, 20  # studies that are drawn, and how many of these are the nodes of one curve


def draw(rng, *, athletes=8, trials=4, effect=1.0, sd_effect=0.5, sd_trial=1.0, sd_measured=0.5, paired=True, nodes=1):
    """Draw a study of one number, or of as many as `nodes`: athletes differ by sd 2, and in their effect."""
    values, rows = [], []
    for athlete in range(athletes):
        level, own = rng.normal(0, 2, nodes), effect + rng.normal(0, sd_effect, nodes)
        for condition in (0, 1) if paired else (athlete % 2,):
            n = trials if isinstance(trials, int) else rng.integers(*trials)
            values.append(level + own * condition + rng.normal(0, np.hypot(sd_trial, sd_measured), (n, nodes)))
            rows += [(athlete, condition)] * n
    athlete, condition = np.array(rows).T
    drawn = np.concatenate(values)
    return Cells(values=drawn, variance=np.full_like(drawn, sd_measured**2), athlete=athlete, condition=condition)


def means_of(cells, condition):
    return np.array([cells.mean(athlete, condition)[0] for athlete in cells.athletes_in(condition)])


def test_equal_numbers_of_trials_are_the_paired_t_test_of_athletes():
    cells = draw(np.random.default_rng(0))
    found, known = estimate_difference(cells, 0, 1), ttest_rel(means_of(cells, 1), means_of(cells, 0))
    interval = known.confidence_interval(0.95)
    assert found.level == "within athletes"
    np.testing.assert_allclose([found.low[0], found.high[0], found.p[0]], [*interval, known.pvalue], rtol=1e-6)


def test_groups_of_athletes_are_welchs_t_test():
    cells = draw(np.random.default_rng(1), athletes=12, paired=False)
    found, known = estimate_difference(cells, 0, 1), ttest_ind(means_of(cells, 1), means_of(cells, 0), equal_var=False)
    assert found.level == "between athletes"
    np.testing.assert_allclose(found.p[0], known.pvalue, rtol=1e-6)


def test_a_single_athletes_trials_are_welchs_t_test():
    cells = draw(np.random.default_rng(2), athletes=1, trials=7)
    a, b = (cells.values[cells.condition == k, 0] for k in (0, 1))
    found = estimate_difference(cells, 0, 1)
    assert found.level == "between trials"
    np.testing.assert_allclose(found.p[0], ttest_ind(b, a, equal_var=False).pvalue, rtol=ROUNDTRIP)


def test_exchanged_conditions_exchange_the_interval():
    cells = draw(np.random.default_rng(3), trials=(2, 7))
    there, back = estimate_difference(cells, 0, 1), estimate_difference(cells, 1, 0)
    np.testing.assert_allclose(there.low, -back.high, rtol=ROUNDTRIP)
    np.testing.assert_allclose(there.p, back.p, rtol=ROUNDTRIP)


def test_nodes_of_a_curve_are_each_for_itself():
    rng = np.random.default_rng(4)
    cells = [draw(rng, trials=3) for _ in range(5)]
    values, variance = (np.hstack([getattr(each, name) for each in cells]) for name in ("values", "variance"))
    curve = Cells(values=values, variance=variance, athlete=cells[0].athlete, condition=cells[0].condition)
    alone = np.array([estimate_difference(each, 0, 1).low[0] for each in cells])
    np.testing.assert_allclose(estimate_difference(curve, 0, 1).low, alone, rtol=ROUNDTRIP)


def test_equal_means_pool_to_themselves_without_spread():
    mean, variance, least, between = pool(np.full((4, 1), 3.0), np.full((4, 1), 0.2))
    np.testing.assert_allclose([mean[0], variance[0], least[0], between[0]], [3.0, 0.0, 0.05, 0.0], atol=EXACT)


def test_athletes_who_are_alike_by_chance_make_no_interval_narrower_than_the_measurement():
    values = np.array([[1.0], [1.1], [1.0], [1.1]])
    at = {"athlete": np.array([0, 0, 1, 1]), "condition": np.array([0, 1, 0, 1])}
    found = estimate_difference(Cells(values=values, variance=np.full((4, 1), 0.05**2), **at), 0, 1)
    half = 1.96 * 0.05  # of each difference 0.05 sqrt(2), of their mean 0.05
    np.testing.assert_allclose([found.low[0], found.high[0]], [0.1 - half, 0.1 + half], atol=1e-4)
    np.testing.assert_allclose(found.p[0], 2 * norm.sf(0.1 / 0.05))


def test_differences_that_are_all_the_same_have_no_interval_where_nothing_is_stated():
    values = np.array([[1.0], [2.0], [3.0], [4.0]])
    at = {"athlete": np.array([0, 0, 1, 1]), "condition": np.array([0, 1, 0, 1])}
    found = estimate_difference(Cells(values=values, variance=np.zeros((4, 1)), **at), 0, 1)
    assert found.value[0] == 1
    assert np.isnan([found.low[0], found.high[0], found.p[0]]).all()


def test_the_variance_between_athletes_is_found():
    rng = np.random.default_rng(5)
    own = rng.uniform(0.5, 1.5, (4000, 1))
    means = 1 + rng.normal(0, np.sqrt(2.0**2 + own))
    np.testing.assert_allclose(pool(means, own).between, 4.0, rtol=0.1)


def test_trials_differ_by_themselves_and_by_the_measurement():
    cells = draw(np.random.default_rng(6), athletes=200, trials=5, sd_trial=1.2, sd_measured=0.5)
    spread = within_spread(cells)
    np.testing.assert_allclose(spread.sd_within, 1.3, rtol=0.08)
    np.testing.assert_allclose(spread.mdc, 1.96 * np.sqrt(2) * 1.3, rtol=0.08)


def test_without_repeated_trials_the_measurement_alone_is_known():
    spread = within_spread(draw(np.random.default_rng(7), trials=1))
    np.testing.assert_allclose(spread.sd_measurement, 0.5, atol=EXACT)
    assert np.isnan([spread.sd_within, spread.mdc]).all()


@pytest.mark.parametrize("options", [{}, {"trials": (2, 7)}, {"athletes": 16, "paired": False}])
def test_intervals_hold_the_truth_as_often_as_they_say(options):
    rng, covered, alarms = np.random.default_rng(8), 0, 0
    for _ in range(RUNS // NODES):
        found = estimate_difference(draw(rng, nodes=NODES, **options), 0, 1)
        covered += np.sum((found.low <= 1.0) & (found.high >= 1.0))
        alarms += np.sum(estimate_difference(draw(rng, effect=0.0, nodes=NODES, **options), 0, 1).p < 0.05)
    error = 3 * np.sqrt(0.05 * 0.95 / RUNS)
    np.testing.assert_allclose([covered / RUNS, alarms / RUNS], [0.95, 0.05], atol=error)


def test_p_values_after_holm():
    np.testing.assert_allclose(adjust_holm([0.04, np.nan, 0.01, 0.03]), [0.06, np.nan, 0.03, 0.06])
    assert adjust_holm([0.9, 0.8]) == [1.0, 1.0]
