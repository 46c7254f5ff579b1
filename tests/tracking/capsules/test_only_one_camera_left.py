"""One camera does not see how far away a player is."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking import Status
from tests.support.jumping_scenes import errors_mm, share_within, statuses, tracked

ALONE = range(8, 16)


@pytest.fixture(scope="module")
def estimates(hall):
    alone = replace(hall, is_without=lambda index, number: number != 1 and index in ALONE)
    return tracked(alone, range(22))[0]


def test_it_is_uncertain_while_one_camera_is_left_and_never_hidden(estimates):
    expected = [Status.UNCERTAIN if index in ALONE else Status.TRACKED for index in range(22)]
    assert statuses(estimates) == expected
    assert [each.n_views for each in estimates] == [1 if index in ALONE else 3 for index in range(22)]
    assert all(np.isfinite(each.points).all() for each in estimates)


def test_the_region_grows_to_hold_the_truth(hall, estimates):
    assert share_within(hall, estimates[8:16]) >= 0.8
    variance = [np.trace(each.covariance[:6].mean(axis=0)) for each in estimates]
    assert np.all(np.diff(variance[7:11]) > 0)  # until as much is gained as lost
    assert min(variance[11:16]) > 2 * variance[7]


def test_a_player_is_followed_again_when_the_others_are_back(hall, estimates):
    assert np.median(errors_mm(hall, estimates)[18:]) < 25


def test_one_camera_from_the_start_is_never_certain(hall):
    [estimates] = tracked(replace(hall, is_without=lambda index, number: number != 1), range(4))
    assert set(statuses(estimates)) == {Status.UNCERTAIN}
