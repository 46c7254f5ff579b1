"""Torsos of all players are tracked together, also where two cross."""

import numpy as np
import pytest

from airborne.errors import TrialError
from airborne.tracking.particle import GivenTorsos, torso_tracker
from airborne.tracking.particle.torso import MEMORY, extrapolate
from airborne.tracking.players import PlayerStart
from tests.support.courts import BLUE, FPS, RED, Court, Player, still

ROUND_M = 0.06  # torsos of 0.42 m at 70 px/m, viewed within 40° of each other


def followed(court, n, seed=0):
    """The estimated torsos (n, players, 3), and the true ones."""
    tracker = torso_tracker(court.rig, court.starts(), seed)
    state, estimates = tracker.init(), []
    for index in range(n):
        state, torsos = tracker.step(state, court.frames(index))
        estimates.append(torsos)
    return np.array(estimates), court.torsos(n)


def walk(speed_m_s):
    return lambda time_s: np.array([speed_m_s * time_s, 0.0, 0.0])


def test_a_jumper_is_followed_up_and_down():
    estimates, truth = followed(Court(), 40)
    assert truth[:, 0, 2].max() > truth[0, 0, 2] + 0.15
    assert np.linalg.norm(estimates - truth, axis=-1).max() < ROUND_M


@pytest.mark.parametrize("shirt", [BLUE, RED], ids=["other shirt", "same shirt"])
def test_two_players_who_cross_keep_their_names(shirt):
    court = Court(
        players=(
            Player("one", (-0.8, 0.0), RED, walk(2.4)),
            Player("two", (0.8, 0.9), shirt, walk(-2.4), has_legs=False),
        )
    )
    estimates, truth = followed(court, 40)
    assert truth[-1, 0, 0] > 0.7 > -0.7 > truth[-1, 1, 0]
    wrong = np.linalg.norm(estimates - truth, axis=-1)
    assert wrong[-1].max() < 2 * ROUND_M
    assert wrong.max() < 5 * ROUND_M, "while one stands before the other, fewer cameras are left"


def test_a_torso_that_no_camera_shows_goes_on_and_then_stays():
    court = Court(players=(Player("one", motion=walk(1.0)),), state=lambda i, name: "fine" if i < 8 else "none")
    estimates, truth = followed(court, 30)
    x = estimates[:, 0, 0]
    assert abs(x[8 + MEMORY - 1] - truth[8 + MEMORY - 1, 0, 0]) < 2 * ROUND_M
    assert np.array_equal(estimates[-1], estimates[16])


def test_one_dark_camera_does_not_matter():
    estimates, truth = followed(Court(state=lambda i, name: "dark" if name == "left" else "fine"), 30)
    assert np.linalg.norm(estimates - truth, axis=-1).max() < 2 * ROUND_M


def test_one_seed_gives_one_result_and_another_another():
    court = Court(players=(Player("one", motion=still),))
    first, again, other = (followed(court, 5, seed)[0] for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_the_prediction_is_exact_for_a_line():
    times_s = np.array([0.0, 1, 3, 4, 7]) / FPS
    line = lambda t: np.array([[1.0, 2.0, 0.5], [0, 1, 2]]) + t * np.array([[1.0, -2, 3], [0, 0, 1]])  # noqa: E731
    past = np.array([line(t) for t in times_s])
    assert np.allclose(extrapolate(times_s, past, 0.2, 1), line(0.2))
    assert np.allclose(extrapolate(times_s[:1], past[:1], 0.2, 1), past[0])


def test_the_prediction_by_a_parabola_is_exact_for_free_flight():
    times_s = np.arange(6) / FPS
    heights = 1.2 + 3 * times_s - 4.905 * times_s**2
    past = np.stack([0 * heights, 0 * heights, heights], axis=-1)[:, None]
    assert extrapolate(times_s, past, 0.1, 2)[0, 2] == pytest.approx(1.2 + 0.3 - 0.04905)


@pytest.mark.parametrize("degree, is_stable", [(1, True), (2, False)])
def test_only_the_line_through_its_own_estimates_is_stable_where_images_say_little(degree, is_stable):
    times_s = np.arange(-6, 0) / FPS
    weights = np.array([extrapolate(times_s, one.reshape(6, 1, 1), 0.0, degree)[0, 0] for one in np.eye(6)])
    corrected = 0.2  # the share of its error that the images correct each frame
    roots = np.roots(np.r_[1, -(1 - corrected) * weights[::-1]])
    assert (np.abs(roots).max() < 1) == is_stable


def test_given_torsos_stand_in_and_hold_over_gaps():
    torsos = np.zeros((4, 1, 3)) + np.arange(4.0)[:, None, None]
    torsos[2] = np.nan
    given = GivenTorsos(torsos, first=0)
    state, heights = given.init(), []
    for index in range(6):
        state, now = given.step(state, Court(players=()).frames(index))
        heights.append(now[0, 0])
    assert heights == [0, 1, 1, 3, 3, 3]


@pytest.mark.parametrize("shape", [(4, 3), (0, 1, 3), (2, 1, 2)])
def test_given_torsos_of_another_shape_are_refused(shape):
    with pytest.raises(TrialError, match="given torsos have shape"):
        GivenTorsos(np.zeros(shape))


def test_a_start_without_a_torso_is_refused():
    with pytest.raises(TrialError, match="player 'x' has no torso"):
        torso_tracker(Court().rig, [PlayerStart(name="x", joints_m={"hip_left": np.zeros(3)})])
