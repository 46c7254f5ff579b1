"""Joints set by hand are 40 mm off, each in its own direction."""

import numpy as np

from airborne.tracking import Status
from tests.support.jumping_scenes import errors_mm, share_within, statuses, tracked


def test_the_pictures_correct_the_start(hall):
    starts = hall.starts(0.04)
    set_by_hand = np.array([starts[0].joints_m[name] for name in list(starts[0].joints_m)[:6]])
    assert np.allclose(np.linalg.norm(set_by_hand - hall.truth("anna", 0)[:6], axis=1), 0.04)
    [estimates] = tracked(hall, range(14), starts)
    assert set(statuses(estimates)) == {Status.TRACKED}
    errors = errors_mm(hall, estimates)
    assert np.median(errors[0]) < 30
    assert np.median(errors) < 40
    assert np.median(errors[-1]) < 25
    assert share_within(hall, estimates) >= 0.8
