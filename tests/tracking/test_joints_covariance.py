"""The covariance of a body with joints covers every joint, and a body whose shape is fixed keeps its joints."""

import numpy as np
import pytest

from airborne.body.chain import delta_between
from airborne.tracking.methods import Settings, tracker_of
from tests.support.people import HUMAN, person, tracker, wrong
from tests.support.scenes import FIGURE, LIGHTS, Scene, standing, statuses, track
from tests.support.tolerances import EXACT

STILL = Scene(FIGURE, lambda time_s: standing(0))
LOOPS = ((0.02, 0.035), (0.01, 0.017))
SCENES = {"figure": Scene(FIGURE, standing), "person": person()}


@pytest.fixture(scope="module", params=SCENES)
def run(request):
    scene = SCENES[request.param]
    return scene, track(scene, range(3), tracker(scene, wrong(scene.start(), model=scene.model)))


def test_covariance_is_symmetric_and_positive_over_root_and_joints(run):
    scene, estimates = run
    n = 6 + 3 * (len(scene.model.segments) - 1)
    assert n == (57 if scene.model is HUMAN else 21)
    for estimate in estimates:
        assert estimate.covariance.shape == (n, n)
        np.testing.assert_array_equal(estimate.covariance, estimate.covariance.T)
        observed = np.isfinite(np.diag(estimate.covariance))
        assert np.all(np.isfinite(estimate.covariance[np.ix_(observed, observed)]))
        assert np.linalg.eigvalsh(estimate.covariance[np.ix_(observed, observed)]).min() > -EXACT
        assert np.all(np.diag(estimate.covariance) > 0)
        unobserved = np.flatnonzero(~observed)
        assert not np.delete(estimate.covariance[unobserved], unobserved, axis=1).any()


def test_errors_are_about_as_large_as_the_covariance_says(run):
    """Six in seven within two sds; and the sds are not uselessly wide."""
    scene, estimates = run
    ratios = []
    for estimate in estimates:
        off = delta_between(scene.start(estimate.index), estimate.pose)
        sd = np.sqrt(np.diag(estimate.covariance))
        ratios.append((off / sd)[np.isfinite(sd)])
    ratios = np.concatenate(ratios)
    assert np.mean(np.abs(ratios) < 2) > 0.857
    assert np.sqrt(np.mean(ratios**2)) > 0.15


def test_fixed_shape_moves_the_root_alone():
    start = wrong(STILL.start(), off_deg=0, model=FIGURE)
    estimates = track(STILL, range(2), tracker(STILL, start, fixed_shape=True))
    assert statuses(estimates) == ["tracked"] * 2
    for estimate in estimates:
        assert estimate.covariance.shape == (21, 21)
        assert not estimate.covariance[6:].any()
        assert np.all(np.diag(estimate.covariance)[:6] > 0)
        np.testing.assert_allclose(estimate.pose.joint_angles, start.joint_angles, atol=EXACT)
        assert np.abs(delta_between(STILL.start(), estimate.pose)[:3]).max() < 0.004


@pytest.mark.parametrize("method", ["stepping", "simplex"])
def test_methods_that_only_evaluate_a_score_keep_the_joints_of_the_start(method):
    start = STILL.start()
    settings = Settings(method=method, loops=LOOPS, lights=LIGHTS, scale=2)
    (estimate,) = track(STILL, range(1), tracker_of(settings, FIGURE, start))
    assert str(estimate.status) == "tracked"
    np.testing.assert_array_equal(estimate.pose.joint_angles, start.joint_angles)
    assert estimate.covariance.shape == (21, 21)
    assert not estimate.covariance[6:].any()
    assert np.all(np.diag(estimate.covariance)[:6] > 0)
    assert np.abs(delta_between(start, estimate.pose)[:3]).max() < 0.03
