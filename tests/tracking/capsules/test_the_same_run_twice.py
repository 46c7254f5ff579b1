"""A run is a function of its images and its start."""

import numpy as np
import pytest

from airborne.tracking.capsules import Blocker
from tests.support.jumping_scenes import Hall, hop, tracked
from tests.support.states import assert_same, leaves

N = 4


@pytest.fixture(scope="module")
def far_apart():
    return Hall({"anna": hop((-1.9, 0.0)), "ben": hop((2.1, 0.6), heading=-0.4, late_s=0.06)})


@pytest.fixture(scope="module")
def estimates(far_apart):
    return tracked(far_apart, range(N))


def assert_equal(estimates, others):
    for each, other in zip(estimates, others, strict=True):
        np.testing.assert_array_equal(each.points, other.points)
        np.testing.assert_array_equal(each.covariance, other.covariance)
        assert (each.status, each.score, each.n_views) == (other.status, other.score, other.n_views)


def test_the_same_run_twice_is_equal_to_the_last_bit(far_apart, estimates):
    for each, other in zip(estimates, tracked(far_apart, range(N)), strict=True):
        assert_equal(each, other)


def test_the_order_of_players_does_not_matter(far_apart, estimates):
    anna, ben = estimates
    ben_first, anna_second = tracked(far_apart, range(N), far_apart.starts()[::-1])
    assert_equal(anna, anna_second)
    assert_equal(ben, ben_first)


def test_a_player_far_away_does_not_matter(far_apart, estimates):
    anna, _ = estimates
    [alone] = tracked(far_apart, range(N), far_apart.starts()[:1])
    assert_equal(anna, alone)


def test_step_leaves_its_state_as_it_was(far_apart):
    blocker = Blocker(far_apart.starts())
    state, _ = blocker.step(blocker.init(), far_apart.frames(0))
    before = leaves(state)
    later, once = blocker.step(state, far_apart.frames(1))
    later_again, again = blocker.step(state, far_apart.frames(1))
    assert_equal(once, again)
    assert_same(leaves(later), leaves(later_again))
    assert_same(leaves(state), before)
