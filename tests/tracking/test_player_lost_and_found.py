"""Players who are out of sight for a while are found again, each as who it is; where two could be meant, it is said."""

from itertools import product

import numpy as np

from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.recovery import colour_nats, identity_probabilities
from tests.support.jumping_scenes import Hall, hop

AWAY = range(3, 13)  # frames at 50 a second
BACK = 18


def elsewhere(before, after):
    """Somebody who stands at one place until out of sight, then at another."""
    first, second = hop(before, heading=np.pi, late_s=9), hop(after, heading=np.pi, late_s=9)
    return lambda t: first(0.0) if t * 50 < AWAY.stop else second(0.0)


def run(hall: Hall, n_frames=BACK):
    """Track the first player of a hall."""
    tracker = Blocker(hall.starts()[:1])
    state, steps = tracker.init(), []
    for index in range(n_frames):
        state, estimates = tracker.step(state, hall.frames(index))
        steps.append(estimates)
    return [list(each) for each in zip(*steps, strict=True)]


def test_a_player_who_was_out_of_sight_is_found_again_where_it_came_back():
    hall = Hall({"a": elsewhere((0.0, -0.6), (0.7, -0.3))}, is_there=lambda index: index not in AWAY)
    (estimates,) = run(hall)
    assert [each.status for each in estimates[6 : AWAY.stop - 1]] == [Status.LOST] * (AWAY.stop - 7)
    assert sum(each.note.startswith("found again after 0.") for each in estimates) == 1
    assert estimates[-1].status is not Status.LOST
    off_m = np.linalg.norm(estimates[-1].points - hall.truth("a", BACK - 1), axis=1)
    assert off_m[:6].mean() < 0.05


def test_a_team_mate_who_stood_there_before_is_not_taken_for_a_player_who_left():
    stays, leaves = hop((1.1, -0.6), heading=np.pi, late_s=9), hop((0.0, -0.6), heading=np.pi, late_s=9)
    far = hop((0.0, -60.0), heading=np.pi, late_s=9)
    hall = Hall({"a": lambda t: leaves(t) if t * 50 < AWAY.start else far(t), "mate": stays})
    (estimates,) = run(hall, AWAY.stop)
    assert [each.status for each in estimates[6:]] == [Status.LOST] * (AWAY.stop - 6)
    assert not any(each.note for each in estimates[1:])


def test_identities_are_those_that_fit_all_of_the_lost_best():
    nats = np.array([[6.0, 5.0], [6.0, -2.0]])  # both are like the first, only one of them like the second
    probability = identity_probabilities(nats)
    assert probability[0, 1] > 0.95 and probability[1, 0] > 0.95
    assert probability.sum(axis=0).max() < 1 + 1e-12


def test_probabilities_are_sums_over_all_assignments():
    nats = np.random.default_rng(7).normal(0, 3, (3, 4))
    nats[0, 2] = -np.inf
    expected, total = np.zeros(nats.shape), 0.0
    for chosen in product(range(-1, 4), repeat=3):
        taken = [j for j in chosen if j >= 0]
        if len(set(taken)) == len(taken):
            weight = np.exp(sum(nats[i, j] for i, j in enumerate(chosen) if j >= 0))
            total += weight
            for i, j in enumerate(chosen):
                if j >= 0:
                    expected[i, j] += weight
    np.testing.assert_allclose(identity_probabilities(nats), expected / total, atol=1e-12)


def test_a_dozen_who_are_lost_together_are_told_apart():
    nats = np.where(np.eye(12) > 0, 9.0, 1.0)
    assert np.diag(identity_probabilities(nats)).min() > 0.95


def test_two_who_could_both_be_meant_are_not_told_apart():
    probability = identity_probabilities(np.array([[6.0, 6.1]]))
    assert probability.max() < 0.95 < probability.sum()


def test_of_two_who_were_lost_together_the_fits_to_the_same_pixels_tell_who_is_who():
    share = np.ones((2, 2))  # both are seen as well as ever, in whoever stands there
    unlike, alike = np.array([[600.0, 500.0], [500.0, 520.0]]), np.array([[600.0, 510.0], [590.0, 520.0]])
    assert np.diag(identity_probabilities(4 + colour_nats(share, unlike))).min() > 0.95
    assert np.diag(identity_probabilities(4 + colour_nats(share, alike))).max() < 0.95


def test_one_who_was_lost_alone_has_nobody_to_be_compared_with():
    share, total = np.array([[0.9, -np.inf]]), np.array([[300.0, -np.inf]])
    np.testing.assert_allclose(colour_nats(share, total), [[2.0, -np.inf]], atol=1e-12)


def test_nobody_like_a_lost_player_is_nobody():
    assert identity_probabilities(np.array([[-8.0]])).max() < 0.01
    assert identity_probabilities(np.empty((2, 0))).shape == (2, 0)
