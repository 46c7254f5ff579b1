"""A spheroid's spin about its own axis cannot be seen, and no number is given for it."""

import numpy as np

from tests.support.scenes import BALL, SPINDLE, Scene, errors, statuses, track


def test_ball_has_a_position_and_no_rotation():
    scene = Scene(model=BALL)
    estimates = track(scene, range(5))
    assert statuses(estimates) == ["tracked"] * 5
    for estimate in estimates:
        variance = np.diag(estimate.covariance)
        np.testing.assert_array_equal(variance[3:], np.inf)
        assert np.all(variance[:3] < 0.003**2)
        assert errors(scene, estimate)[0] < 3


def test_spindle_shows_where_its_axis_points_and_not_its_spin():
    scene = Scene(model=SPINDLE)
    estimates = track(scene, range(5))
    assert statuses(estimates) == ["tracked"] * 5
    for estimate in estimates:
        assert errors(scene, estimate)[0] < 3
        truth = scene.motion(estimate.time_s).world_from_root
        axis, true_axis = (R.apply([0, 0, 1]) for R in (estimate.pose.world_from_root.rotation, truth.rotation))
        assert np.degrees(np.arccos(axis @ true_axis)) < 1
        touched = np.abs(axis) > 0.15
        assert np.all(np.isinf(np.diag(estimate.covariance)[3:][touched]))
        assert np.all(np.diag(estimate.covariance)[:3] < 0.003**2)


def test_unobserved_spin_stays_as_it_was():
    scene = Scene(model=BALL)
    turned = [
        estimate.pose.world_from_root.rotation * scene.start().world_from_root.rotation.inv()
        for estimate in track(scene, range(3))
    ]
    assert max(rotation.magnitude() for rotation in turned) < 1e-6
