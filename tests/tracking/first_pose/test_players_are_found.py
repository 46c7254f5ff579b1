"""Players who stand are found in single images, without anything set by hand."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from airborne.errors import TrialError
from airborne.tracking.capsules.first_frame import points_of
from airborne.tracking.capsules.jumper import JOINTS, N_DOF, SHANK, THIGH
from airborne.tracking.capsules.standing import stance, states_of
from airborne.tracking.first_pose.players import PlayersSearch, find_players, probability_right
from tests.support.jumping_scenes import Hall, hop

AT_NET = {"left": (-0.1, -0.7), "right": (0.9, -0.6)}
HALL = Hall({name: hop(at, heading=np.pi) for name, at in AT_NET.items()})


@cache
def found() -> PlayersSearch:
    frames = {index: HALL.frames(index) for index in (0, 2)}
    return find_players(list(frames.values()), frames.__getitem__)


def test_both_players_are_found_where_they_stand_and_facing_the_net():
    best = found().candidates[0]
    assert [start.name for start in best.starts] == ["player1", "player2"]
    for start, name in zip(best.starts, HALL.motions, strict=True):
        off_m = np.array([start.joints_m[joint] for joint in JOINTS]) - HALL.truth(name, found().frames.index)
        assert np.linalg.norm(off_m, axis=1).mean() < 0.05


def test_the_candidates_probabilities_are_those_of_alternatives():
    candidates = found().candidates
    assert found().is_decided == (candidates[0].is_plausible and candidates[0].probability >= 0.95)
    assert sum(candidate.probability for candidate in candidates) < 1 + 1e-9
    assert all(a.share >= b.share for a, b in pairwise(candidates))


def test_players_are_taken_only_where_the_legs_of_every_one_are_likely_right():
    best = found().candidates[0]
    for probability, is_decided in ((0.99, True), (0.6, False)):
        players = (replace(best.players[0], probability=0.99), replace(best.players[1], probability=probability))
        assert replace(found(), candidates=(replace(best, players=players),)).is_decided == is_decided


def test_legs_that_reach_down_from_the_air_or_far_from_their_stance_or_ill_seen_are_likely_wrong():
    player = found().candidates[0].players[0]
    longer, straight = player.state.copy(), player.state.copy()
    longer[[N_DOF + THIGH, N_DOF + SHANK]] += 0.05
    straight[[11, 16]] = 0.1
    likely = probability_right(player.state, 0.03, 2.0)
    for less_likely in (
        probability_right(longer, 0.03, 2.0),
        probability_right(straight, 0.03, 2.0),
        probability_right(player.state, 0.2, 2.0),
        probability_right(player.state, 0.03, 0.8),
    ):
        assert less_likely < 0.5 < likely


def test_nobody_at_the_net_is_said():
    hall = Hall({"far": hop((0.3, 2.4), heading=np.pi)})
    frames = {0: hall.frames(0)}
    with pytest.raises(TrialError, match="no player is seen to stand at the net"):
        find_players(list(frames.values()), frames.__getitem__)


def test_a_stance_stands_on_the_floor_or_its_height_over_it():
    stances = np.array([stance(0.3, -0.5, 2.0, knee) for knee in (0.2, 0.8, 1.2)])
    stances[2, -1] = 0.4
    states = states_of(stances)
    lowest = [points_of(state)[6:8, 2].min() for state in states]
    np.testing.assert_allclose(lowest, [0.03, 0.03, 0.43], atol=1e-9)
