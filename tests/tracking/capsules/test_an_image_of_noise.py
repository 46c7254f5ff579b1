"""Pictures that show nothing but noise, or an empty floor."""

from dataclasses import replace

import numpy as np

from airborne.tracking import Status
from tests.support.jumping_scenes import errors_mm, statuses, tracked


def test_nothing_is_invented_from_noise(hall):
    noisy = replace(hall, is_noise=lambda index, number: index >= 6)
    [estimates] = tracked(noisy, range(14))
    assert statuses(estimates) == [Status.TRACKED] * 6 + [Status.LOST] * 8
    for each in estimates[6:]:
        assert np.isnan(each.points).all() and np.isnan(each.covariance).all() and np.isnan(each.score)


def test_one_noisy_camera_of_three_does_little_harm(hall):
    noisy = replace(hall, is_noise=lambda index, number: number == 0 and index >= 6)
    [estimates] = tracked(noisy, range(22))
    assert np.median(errors_mm(hall, estimates)) < 25
    assert estimates[-1].n_views == 2


def test_a_start_in_noise_is_never_certain(hall):
    [estimates] = tracked(replace(hall, is_noise=lambda index, number: True), range(6))
    assert Status.TRACKED not in statuses(estimates)
    assert estimates[0].n_views < 2


def test_a_start_on_an_empty_floor_is_never_certain(hall):
    [estimates] = tracked(replace(hall, is_there=lambda index: False), range(8))
    assert Status.TRACKED not in statuses(estimates)
