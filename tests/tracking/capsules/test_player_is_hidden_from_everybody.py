"""For a few frames, no camera shows the player: an empty floor is all there is."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking import Status
from tests.support.jumping_scenes import errors_mm, statuses, tracked

N = 24


@pytest.fixture(scope="module")
def estimates(hall):
    return tracked(replace(hall, is_there=lambda index: index not in range(12, 16)), range(N))[0]


def test_it_is_lost_while_nothing_is_there(estimates):
    assert statuses(estimates[12:16]) == [Status.LOST] * 4
    assert all(np.isnan(each.points).all() for each in estimates[12:16])


def test_it_is_found_again_at_once_where_it_was(hall, estimates):
    assert statuses(estimates[18:]) == [Status.TRACKED] * (N - 18)
    assert np.median(errors_mm(hall, estimates[18:])) < 25


def test_what_is_called_tracked_lies_on_the_player(hall):
    [estimates] = tracked(replace(hall, is_there=lambda index: index not in (12, 13)), range(36))
    certain = [each for each in estimates if each.status is Status.TRACKED]
    assert np.nanmax(errors_mm(hall, certain)) < 100
