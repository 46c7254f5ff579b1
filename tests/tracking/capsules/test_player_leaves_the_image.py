"""A player glides out of every image."""

import numpy as np
import pytest

from airborne.tracking import Status
from tests.support.jumping_scenes import CAMERAS, SIZE, Hall, errors_mm, share_within, statuses, tracked, walk

N = 48
NARROW = tuple(each.resample(scale=(1, 1), offset=(120, 0), size=(200, SIZE[1])) for each in CAMERAS)


@pytest.fixture(scope="module")
def leaving():
    return Hall({"anna": walk((0.0, 0.0), (3.0, 0.0), 0.3)}, cameras=NARROW)


@pytest.fixture(scope="module")
def estimates(leaving):
    return tracked(leaving, range(N))[0]


def views_with_all_joints(hall, index):
    points = hall.truth("anna", index)[:6]
    u = np.array([each.px_from_world(points)[:, 0] for each in hall.cameras])
    return int(np.count_nonzero(np.all((u > 0) & (u < NARROW[0].size[0] - 1), axis=1)))


def test_a_player_is_tracked_while_two_images_show_all_joints(leaving, estimates):
    inside = [i for i in range(N) if views_with_all_joints(leaving, i) >= 2]
    assert len(inside) > 25
    assert {estimates[i].status for i in inside} == {Status.TRACKED}
    assert np.median(errors_mm(leaving, [estimates[i] for i in inside])) < 25


def test_a_player_outside_every_image_is_never_certain(leaving, estimates):
    outside = [i for i in range(N) if views_with_all_joints(leaving, i) == 0]
    assert len(outside) > 3
    assert Status.TRACKED not in {estimates[i].status for i in outside}


def test_in_the_end_the_player_is_lost_and_has_no_numbers(estimates):
    last = estimates[-1]
    assert last.status is Status.LOST
    assert np.isnan(last.points).all() and np.isnan(last.covariance).all() and np.isnan(last.score)
    assert last.n_views == 0


def test_a_player_never_counts_as_found_once_lost_outside(estimates):
    first_lost = statuses(estimates).index(Status.LOST)
    assert set(statuses(estimates[first_lost:])) == {Status.LOST}


def test_what_is_still_stated_holds_the_truth(leaving, estimates):
    stated = [each for each in estimates if each.status is not Status.LOST]
    assert share_within(leaving, stated) >= 0.8
