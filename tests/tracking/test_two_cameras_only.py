"""Two cameras are enough."""

import numpy as np

from tests.support.scenes import CAMERAS, Scene, statuses, track, worst

TWO = Scene(cameras=CAMERAS[:2])


def test_two_cameras_track_to_a_few_millimetres():
    estimates = track(TWO, range(6))
    assert statuses(estimates) == ["tracked"] * 6
    assert [estimate.n_views for estimate in estimates] == [2] * 6
    position_mm, rotation_deg = worst(TWO, estimates)
    assert position_mm < 3
    assert rotation_deg < 1


def test_two_cameras_are_less_sure_than_four():
    pairs = zip(track(TWO, range(3)), track(Scene(), range(3)), strict=True)
    for two, four in pairs:
        assert np.trace(two.covariance[:3, :3]) > np.trace(four.covariance[:3, :3])
