"""Where there is nothing to see, the body is lost; nothing breaks and nothing is invented."""

import numpy as np
import pytest

from airborne.tracking.methods import Settings, tracker_of
from tests.support.scenes import CROSS, FPS, Scene, statuses, thrown, track, worst

EMPTY = Scene(motion=lambda time_s: None)
METHODS = {
    "refined": Settings(),
    "stepping": Settings(method="stepping", loops=((0.01, 0.02), (0.005, 0.01))),
    "simplex": Settings(method="simplex"),
}


@pytest.fixture(params=METHODS)
def settings(request):
    return METHODS[request.param]


def test_first_frame_without_the_body_is_lost():
    assert statuses(track(EMPTY, range(3), tracker_of(Settings(), CROSS, thrown(0)))) == ["lost"] * 3


def test_no_pictures_at_all_is_lost(settings):
    dark = Scene(is_dark=lambda index, name: True)
    assert statuses(track(dark, range(2), tracker_of(settings, CROSS, thrown(0)))) == ["lost"] * 2


def test_start_outside_every_picture_is_lost(settings):
    outside = thrown(0).move(np.array([0, 0, 40.0]), np.zeros(3))
    assert statuses(track(Scene(), range(2), tracker_of(settings, CROSS, outside))) == ["lost"] * 2


def test_body_that_comes_later_to_the_start_pose_is_found():
    late = Scene(motion=lambda time_s: None if time_s * FPS < 2 else thrown(time_s - 2 / FPS))
    estimates = track(late, range(6), tracker_of(Settings(), CROSS, thrown(0)))
    assert statuses(estimates) == ["lost"] * 2 + ["tracked"] * 4
    assert worst(late, estimates)[0] < 3
