"""A leg is taken to be where it is not, as after a quick motion: the trunk's pixels must not vouch for it."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.dynamics import N_FREE, state_at_rest
from airborne.tracking.capsules.track import Everybody
from airborne.tracking.capsules.unseen_legs import find_unseen_legs, free_leg

KICK = np.array([-2.2, 0.1, -0.3, 0.9, -0.1])  # of a leg that is swung up
LEFT, RIGHT = slice(8, 13), slice(13, 18)


@pytest.fixture(scope="module")
def tracker(hall):
    return Blocker(hall.starts())


@pytest.fixture(scope="module")
def kicking(hall, tracker):
    """A track whose left leg is up and sure of it, while the player stands."""
    [track] = tracker.step(tracker.init(), hall.frames(0))[0].players.values()
    free = track.state[:N_FREE].copy()
    free[LEFT] = KICK
    state = np.concatenate([free, track.state[N_FREE:]])
    return replace(track, state=state, filtered=state_at_rest(free, 1e-4 * np.eye(N_FREE)))


def test_the_leg_is_looked_for_where_the_other_is(hall, tracker, kicking):
    _, [estimate] = tracker.step(Everybody({"anna": kicking}, ()), hall.frames(1))
    assert estimate.status is Status.TRACKED
    assert np.linalg.norm(estimate.points - hall.truth("anna", 1), axis=1).max() < 0.06


def test_a_leg_that_no_pixels_show_is_not_tracked(hall, tracker, kicking, monkeypatch):
    monkeypatch.setattr("airborne.tracking.capsules.tracker.free_leg", lambda expected, state, leg: expected)
    _, [estimate] = tracker.step(Everybody({"anna": kicking}, ()), hall.frames(1))
    assert np.linalg.norm(estimate.points[4] - hall.truth("anna", 1)[4]) > 0.3
    assert estimate.status is Status.UNCERTAIN


def test_a_leg_counts_by_its_own_pixels():
    owned = np.ones((3, 10, 2, 2))
    owned[:, 7:, :, 0] = 0.1  # the right leg's evidence
    assert find_unseen_legs(owned, 1.0).tolist() == [1]
    owned[:, 4:7] = 0  # the left leg is hidden altogether
    assert find_unseen_legs(owned, 0.1).tolist() == [0]


def test_a_leg_of_which_nothing_is_known_is_bent_like_the_other(kicking):
    freed = free_leg(kicking.filtered, kicking.state, 0)
    np.testing.assert_allclose(freed.free[LEFT], kicking.state[RIGHT] * [1, -1, -1, 1, 1])
    np.testing.assert_array_equal(np.delete(freed.free, LEFT), np.delete(kicking.filtered.free, LEFT))
    assert np.linalg.eigvalsh(freed.covariance).min() > 0
