"""Distances between joints as log-likelihoods: best at what is expected, worse away from it, never NaN."""

import numpy as np
import pytest

from airborne.tracking.particle.distances import (
    GAP_LEAST_M,
    LENGTH_SD_M,
    gap_term,
    length_term,
    ownership_term,
    position_term,
)

OWN = np.array([0.0, 0.0, 1.2])


def test_one_standard_deviation_costs_half_a_nat():
    assert length_term(np.array([0.45, 0.45 + LENGTH_SD_M]), 0.45) == pytest.approx([0, -0.5])
    assert position_term(np.array([[0.1, 0, 0]]), np.zeros(3), 0.1) == pytest.approx(-0.5)


def test_legs_inside_each_other_are_worse_than_any_gap_between_them():
    inside = gap_term(np.array([GAP_LEAST_M - 1e-6]), 0.2)
    assert inside < gap_term(np.array([GAP_LEAST_M, 0.8]), 0.2).min() - 30
    assert np.isfinite(inside).all()


def test_a_point_under_the_own_torso_is_the_players_and_one_under_another_is_not():
    other = np.array([[0.6, 0.0, 1.2]])
    points = np.array([[0.0, 0.0, 0.1], [0.3, 0.0, 0.1], [0.6, 0.0, 0.1]])
    own, between, theirs = ownership_term(points, OWN, other)
    assert own == pytest.approx(0, abs=0.01)
    assert between == pytest.approx(np.log(0.5))
    assert theirs == pytest.approx(-6, abs=0.01)


def test_others_further_than_one_and_a_half_metres_do_not_count():
    assert not ownership_term(np.array([[1.6, 0.0, 0.0]]), OWN, np.array([[1.6, 0.0, 1.2]])).any()
    assert ownership_term(np.array([[1.4, 0.0, 0.0]]), OWN, np.array([[1.4, 0.0, 1.2]])) < -5


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2)])
def test_shapes_are_kept_also_with_nobody_else(shape):
    points = np.zeros((*shape, 3))
    assert ownership_term(points, OWN, np.zeros((0, 3))).shape == shape
    assert ownership_term(points, OWN, np.array([[0.5, 0, 1], [9, 9, 1]])).shape == shape
    assert position_term(points, OWN, 0.1).shape == shape


def test_height_above_the_torso_counts_as_distance_and_below_does_not():
    other = np.array([[1.0, 0.0, 1.2]])
    low, lower, high = ownership_term(np.array([[0.3, 0, 1.0], [0.3, 0, 0.1], [0.3, 0, 2.2]]), OWN, other)
    assert low == pytest.approx(lower)
    assert high != pytest.approx(low, abs=1e-3)
