"""Two cameras are enough for a person."""

import numpy as np

from tests.support.people import CAMERAS, mean_errors_mm, person, tracker
from tests.support.scenes import statuses, track

TWO, THREE = person(cameras=CAMERAS[:2]), person()


def test_two_cameras_follow_a_person_less_surely_than_three():
    two, three = (track(scene, range(4), tracker(scene)) for scene in (TWO, THREE))
    assert statuses(two) == ["tracked"] * 4
    assert [estimate.n_views for estimate in two] == [2] * 4
    assert mean_errors_mm(TWO, two).max() < 5.5
    for fewer, more in zip(two, three, strict=True):
        assert np.trace(fewer.covariance[:3, :3]) > np.trace(more.covariance[:3, :3])
