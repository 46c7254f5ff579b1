"""How fast players fall tells a world of a wrong size, or a frame rate that is not that of the video."""

import re
from dataclasses import replace

import numpy as np
import pytest

from airborne.motion.jumps.gravity import find_wrong_gravity, measure_gravity
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.players import read_players, write_players
from tests.support.jumping import G, Jumper, motion_of

OF_PLAYERS = ("points", "covariance", "joint_status", "score", "n_views")
CLEAN = motion_of(Jumper())


def test_a_right_world_is_no_alarm_however_many_jumps():
    more = replace(CLEAN, **{name: np.repeat(getattr(CLEAN, name), 9, axis=1) for name in OF_PLAYERS})
    assert find_wrong_gravity(CLEAN) is None
    assert find_wrong_gravity(replace(more, players=tuple("abcdefghi"))) is None


@pytest.mark.parametrize("scale", [0.8, 1.15])
def test_a_world_of_a_wrong_size_is_named_with_its_size_and_the_frame_rate_that_looks_alike(scale):
    right, wrong = measure_gravity(CLEAN), find_wrong_gravity(replace(CLEAN, points=scale * CLEAN.points))
    assert wrong.value_m_s2 == pytest.approx(scale * right.value_m_s2)
    ratio = wrong.value_m_s2 / G
    percent, way, rate = re.search(r"is (\d+)% too (\w+), or .* is ([\d.]+) times that", wrong.sentence).groups()
    assert float(percent) == pytest.approx(100 * abs(ratio - 1), abs=1)
    assert (way, float(rate)) == ("large" if scale > 1 else "small", pytest.approx(ratio**0.5, abs=0.01))
    assert wrong.to_dict()["value"] == pytest.approx(wrong.value_m_s2 - G)


def test_without_a_jump_nothing_is_measured():
    assert measure_gravity(replace(CLEAN, points=0 * CLEAN.points)) is None


def test_players_who_are_doubted_lose_their_heights_and_are_read_back(tmp_path):
    doubted = CLEAN.without_tracked()
    write_players(tmp_path / "joints.csv", doubted)
    again = read_players(tmp_path / "joints.csv")
    assert set(again.joint_status.ravel()) == {"uncertain"}
    assert np.array_equal(again.points, CLEAN.points)
    assert all(np.isnan(jump.hip_height_m.value) for jump in measure_jumps(again))
