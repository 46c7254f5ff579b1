"""A body that is gone for a while is lost, with no numbers, and found again."""

import numpy as np

from tests.support.scenes import FPS, Scene, statuses, thrown, track, worst

ABSENT = (3, 4, 5)
GONE = Scene(motion=lambda time_s: None if time_s * FPS in ABSENT else thrown(time_s))


def test_body_is_lost_while_it_is_gone_and_found_where_it_comes_back():
    estimates = track(GONE, range(9))
    assert statuses(estimates) == ["lost" if index in ABSENT else "tracked" for index in range(9)]
    position_mm, rotation_deg = worst(GONE, estimates)
    assert position_mm < 3
    assert rotation_deg < 1


def test_lost_frame_holds_no_numbers():
    for estimate in track(GONE, range(6))[3:]:
        assert estimate.pose is None
        assert estimate.covariance is None
        assert estimate.n_views == 0
        assert np.isnan(estimate.score)
