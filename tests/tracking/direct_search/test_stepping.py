"""Paper B's stepping on scores whose minimum is known."""

import numpy as np
import pytest

from airborne.tracking.direct_search.stepping import minimise_by_stepping, v_literal
from tests.support.tolerances import EXACT, ROUNDTRIP

RULES = ("v_literal", "v_sym")
MOST_A_VARIABLE = 45


def vee(minimum):
    """A score that rises evenly on both sides, in every variable."""
    return lambda x: np.abs(x - minimum).sum(axis=1) + 3.0


def on_a_line(minimum, v_rule, score=vee, start=0.0):
    best, evaluations = minimise_by_stepping(score(minimum), np.array([start]), [np.ones(1)], v_rule=v_rule)
    return best[0], evaluations


@pytest.mark.parametrize("v_rule", RULES)
@pytest.mark.parametrize("way", [1, -1])
def test_minimum_on_the_far_side_of_the_lowest_point_is_found_exactly(v_rule, way):
    for beyond in (0.0, 0.1, 0.3, 0.49):
        best, _ = on_a_line(way * (4 + beyond), v_rule)
        np.testing.assert_allclose(best, way * (4 + beyond), atol=ROUNDTRIP)


@pytest.mark.parametrize("way", [1, -1])
def test_minimum_on_the_near_side_is_found_by_v_sym_and_missed_by_the_papers_rule(way):
    for short in (0.1, 0.3, 0.49):
        assert on_a_line(way * (4 - short), "v_literal")[0] == way * 4
        np.testing.assert_allclose(on_a_line(way * (4 - short), "v_sym")[0], way * (4 - short), atol=ROUNDTRIP)


@pytest.mark.parametrize("v_rule", RULES)
def test_minimum_within_a_step_of_the_start_is_found_or_no_worse_than_the_start(v_rule):
    for minimum in np.linspace(-0.49, 0.49, 21):
        best, _ = on_a_line(minimum, v_rule)
        assert abs(best - minimum) <= (ROUNDTRIP if v_rule == "v_sym" else abs(minimum) + ROUNDTRIP)


def test_papers_rule_errs_by_a_fifth_of_a_step_over_all_offsets():
    minima = 5 + (np.arange(2000) + 0.5) / 2000
    errors = {rule: [on_a_line(m, rule)[0] - m for m in minima] for rule in RULES}
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(errors["v_literal"]))), 1 / np.sqrt(24), rtol=1e-3)
    np.testing.assert_allclose(errors["v_sym"], 0, atol=ROUNDTRIP)


def test_crossing_of_two_lines_is_bounded_by_the_neighbours():
    assert v_literal(1.0, 0.0, 0.0, 5.0) == pytest.approx(5 / 6, abs=EXACT)
    assert v_literal(0.1, 0.0, 0.0, 0.0) == 0
    assert v_literal(0.1, 0.0, 1.0, 1.1) == -1
    assert v_literal(0.0, 0.0, 0.0, 0.0) == 0


@pytest.mark.parametrize("v_rule", RULES)
def test_all_variables_are_found_in_shrinking_loops(v_rule):
    minimum = np.array([0.123, -0.087, 0.31, 0.2, -0.15, 0.05])
    loops = [np.full(6, size) for size in (0.05, 0.03, 0.02, 0.01, 0.01, 0.005)]
    best, evaluations = minimise_by_stepping(vee(minimum), np.zeros(6), loops, v_rule=v_rule)
    np.testing.assert_allclose(best, minimum, atol=0.0026)
    assert evaluations < 20 * 36


def test_parabola_is_found_within_half_a_step():
    best, _ = on_a_line(7.3, "v_sym", lambda m: lambda x: ((x - m) ** 2).sum(axis=1))
    assert abs(best - 7.3) < 0.5


@pytest.mark.parametrize("v_rule", RULES)
@pytest.mark.parametrize("minimum", [0.2, 3.4, -17.7, 1e9])
def test_evaluations_are_bounded_counted_and_never_repeated(v_rule, minimum):
    evaluated = []

    def score(x):
        evaluated.extend(x[:, 0].tolist())
        return vee(minimum)(x)

    _, evaluations = minimise_by_stepping(score, np.zeros(1), [np.ones(1)], v_rule=v_rule)
    assert len(evaluated) == len(set(evaluated)) == evaluations
    assert evaluations <= min(abs(minimum) + 6, MOST_A_VARIABLE)


def test_search_passes_one_bump_and_stops_at_the_second():
    heights = {0: 9.0, 1: 8.0, 2: 8.5, 3: 7.0, 4: 6.0, 5: 6.5, 6: 7.5, 7: 0.0}

    def score(x):
        return np.array([heights.get(round(k), 20.0) for k in x[:, 0]])

    best, _ = minimise_by_stepping(score, np.zeros(1), [np.ones(1)], v_rule="v_literal")
    assert 3 <= best[0] <= 5


def test_variable_without_a_step_stays():
    best, evaluations = minimise_by_stepping(
        vee(np.array([1.0, 1.0])), np.zeros(2), [np.array([0.0, 1.0])], v_rule="v_sym"
    )
    np.testing.assert_allclose(best, [0, 1], atol=ROUNDTRIP)
    assert evaluations < 10


@pytest.mark.parametrize("v_rule", RULES)
@pytest.mark.parametrize("wall", [0.5, 1.5, 2.5, 3.5])
@pytest.mark.parametrize("way", [1, -1])
def test_infinite_scores_are_never_entered(v_rule, wall, way):
    def score(x):
        return np.where(way * x[:, 0] > wall, np.inf, np.abs(x[:, 0] - way * 2))

    best, _ = minimise_by_stepping(score, np.zeros(1), [np.ones(1)], v_rule=v_rule)
    assert np.isfinite(best).all()
    assert np.isfinite(score(best[None])).all()


@pytest.mark.parametrize("v_rule", RULES)
def test_score_without_slope_leaves_the_start(v_rule):
    best, _ = minimise_by_stepping(lambda x: np.full(len(x), 5.0), np.full(2, 0.5), [np.ones(2)], v_rule=v_rule)
    np.testing.assert_array_equal(best, 0.5)


def test_start_is_left_as_it_was():
    start = np.zeros(1)
    minimise_by_stepping(vee(5.0), start, [np.ones(1)], v_rule="v_sym")
    assert start[0] == 0


@pytest.mark.parametrize("v_rule", RULES)
def test_search_sets_out_toward_the_lower_neighbour_and_past_one_rise(v_rule):
    heights = {-1: 9.5, 0: 9.0, 1: 9.2, 2: 6.0, 3: 5.0, 4: 6.0, 5: 7.0}
    best, _ = minimise_by_stepping(
        lambda x: np.array([heights.get(round(k), 20.0) for k in x[:, 0]]), np.zeros(1), [np.ones(1)], v_rule=v_rule
    )
    assert best[0] == pytest.approx(3, abs=1)


def test_minimum_beside_the_start_is_found_exactly_by_the_papers_rule_on_either_side():
    for minimum in np.linspace(-0.49, 0.49, 11):
        np.testing.assert_allclose(on_a_line(minimum, "v_literal")[0], minimum, atol=ROUNDTRIP)


def test_variables_are_set_in_the_order_given():
    evaluated = []

    def score(x):
        evaluated.extend(int(np.flatnonzero(row != start)[0]) if (row != start).any() else None for row in x)
        return np.zeros(len(x))

    start = np.zeros(3)
    minimise_by_stepping(score, start, [np.ones(3)], v_rule="v_sym", order=(2, 0, 1))
    named = [variable for variable in evaluated if variable is not None]
    assert list(dict.fromkeys(named)) == [2, 0, 1]


def test_order_without_a_variable_leaves_it():
    best, _ = minimise_by_stepping(vee(np.array([1.0, 1.0])), np.zeros(2), [np.ones(2)], v_rule="v_sym", order=(1,))
    np.testing.assert_allclose(best, [0, 1], atol=ROUNDTRIP)
