"""One of three cameras has no image for a while, or a black one."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking import Status
from tests.support.jumping_scenes import errors_mm, statuses, tracked

DARK = range(6, 16)
N = 20


@pytest.fixture(scope="module")
def without(hall):
    return tracked(replace(hall, is_without=lambda index, number: number == 1 and index in DARK), range(N))[0]


@pytest.fixture(scope="module")
def black(hall):
    return tracked(replace(hall, is_black=lambda index, number: number == 1 and index in DARK), range(N))[0]


def test_the_others_carry_on_while_a_camera_has_no_image(hall, without):
    assert set(statuses(without)) == {Status.TRACKED}
    assert [each.n_views for each in without] == [2 if index in DARK else 3 for index in range(N)]
    assert np.median(errors_mm(hall, without)[DARK]) < 25


def test_less_is_known_while_a_camera_has_no_image(without, plain):
    traces = [[np.trace(each[i].covariance[:6].sum(axis=0)) for i in DARK] for each in (without, plain)]
    assert np.all(np.array(traces[0]) > traces[1])


def test_the_others_carry_on_while_a_camera_is_black(hall, black):
    assert np.median(errors_mm(hall, black)[DARK]) < 25
    assert Status.LOST not in statuses(black)


def test_a_black_image_shows_nobody(black):
    assert black[DARK[-1]].n_views == 2


def test_a_camera_that_is_dark_at_first_joins_later(hall):
    late = replace(hall, is_without=lambda index, number: number == 0 and index < 5)
    [estimates] = tracked(late, range(12))
    assert np.median(errors_mm(hall, estimates)) < 25
    assert set(statuses(estimates[1:])) == {Status.TRACKED}


def test_a_camera_that_is_dark_at_first_is_not_counted(hall):
    late = replace(hall, is_without=lambda index, number: number == 0)
    [estimates] = tracked(late, range(2))
    assert [each.n_views for each in estimates] == [2, 2]


def test_lost_while_every_camera_is_dark_and_found_afterwards(hall):
    dark = replace(hall, is_without=lambda index, number: index in DARK)
    [estimates] = tracked(dark, range(N))
    is_dark = np.isin(np.arange(N), DARK)
    assert np.array_equal(np.array(statuses(estimates)) == Status.LOST, is_dark)
    for i in DARK:
        assert np.isnan(estimates[i].points).all() and np.isnan(estimates[i].covariance).all()
        assert np.isnan(estimates[i].score) and estimates[i].n_views == 0
    assert np.median(errors_mm(hall, estimates)[N - 4 :]) < 25
