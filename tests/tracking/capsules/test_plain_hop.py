"""A player squats and hops, nothing in the way."""

import numpy as np

from airborne.tracking import Status
from tests.support.jumping_scenes import errors_mm, share_within, statuses


def test_a_hop_is_followed(hall, plain):
    errors = errors_mm(hall, plain)
    assert set(statuses(plain)) == {Status.TRACKED}
    assert {each.n_views for each in plain} == {3}
    assert np.all(np.median(errors, axis=0) < 25)
    assert errors.max() < 60


def test_truth_lies_in_the_region_that_the_tracker_states(hall, plain):
    assert share_within(hall, plain) >= 0.8


def test_feet_stand_still_until_they_leave_the_floor(hall, plain):
    truth = np.array([hall.truth("anna", each.index)[6:8] for each in plain])
    is_standing = truth[:, 0, 2] < 0.031
    off = np.array([each.points[6:8] for each in plain])[is_standing] - truth[is_standing]
    assert np.count_nonzero(is_standing) > 20
    assert np.all(np.ptp(off, axis=0) < 0.03)


def test_rods_keep_their_lengths(plain):
    points = np.array([each.points for each in plain])
    for a, b in ((0, 1), (0, 2), (1, 3), (2, 4), (3, 5)):
        lengths = np.linalg.norm(points[:, a] - points[:, b], axis=-1)
        assert np.ptp(lengths) < 1e-9


def test_covariances_are_those_of_a_gaussian(plain):
    covariances = np.array([each.covariance for each in plain])
    assert np.isfinite(covariances).all()
    np.testing.assert_allclose(covariances, covariances.swapaxes(-1, -2), atol=1e-12)
    assert np.linalg.eigvalsh(covariances).min() > 0
    assert np.isfinite([each.score for each in plain]).all()
