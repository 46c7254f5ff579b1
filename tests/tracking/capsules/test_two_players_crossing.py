"""Two players in the same colours hop past each other, one in front of the other for every camera in turn."""

import numpy as np
import pytest

from airborne.tracking import Status
from tests.support.jumping_scenes import Hall, errors_mm, statuses, tracked, walk

N = 32


@pytest.fixture(scope="module")
def crossing():
    return Hall({"anna": walk((-0.7, 0.0), (2.4, 0.0), 0.3), "ben": walk((0.7, -0.4), (-2.4, 0.0), -0.2)})


@pytest.fixture(scope="module")
def by_player(crossing):
    return tracked(crossing, range(N))


def test_both_are_followed(crossing, by_player):
    for estimates in by_player:
        assert set(statuses(estimates)) == {Status.TRACKED}
        assert np.median(errors_mm(crossing, estimates)) < 25
        assert errors_mm(crossing, estimates).max() < 80


def test_nobody_becomes_the_other(crossing, by_player):
    apart = [i for i in range(N) if abs(crossing.truth("anna", i)[0, 0] - crossing.truth("ben", i)[0, 0]) > 0.5]
    assert min(apart) < 5 and max(apart) > N - 5
    for own, other in (("anna", "ben"), ("ben", "anna")):
        for i in apart:
            [estimate] = [each[i] for each in by_player if each[i].player == own]
            off, off_other = (
                np.linalg.norm(estimate.points[:6] - crossing.truth(name, i)[:6]) for name in (own, other)
            )
            assert off < 0.2 * off_other


def test_estimates_come_in_the_order_of_the_start(by_player):
    assert [each[0].player for each in by_player] == ["anna", "ben"]
    assert all(len({estimate.player for estimate in each}) == 1 for each in by_player)
