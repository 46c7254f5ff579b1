"""One camera shows everything but the depth, and the covariance says so."""

import numpy as np

from tests.support.scenes import CAMERAS, Scene, statuses, track

ONE = Scene(cameras=CAMERAS[:1])
DEPTH = CAMERAS[0].camera_from_world.rotation.as_matrix()[2]  # the optical axis in the world


def test_one_camera_is_exact_across_its_view_and_unsure_along_it():
    estimates = track(ONE, range(6))
    assert set(statuses(estimates)) <= {"tracked", "uncertain"}
    for estimate in estimates:
        truth = ONE.motion(estimate.time_s).world_from_root
        error = estimate.pose.world_from_root.translation - truth.translation
        across = error - DEPTH * (DEPTH @ error)
        assert np.linalg.norm(across) < 0.003
        sd_along = np.sqrt(DEPTH @ estimate.covariance[:3, :3] @ DEPTH)
        assert sd_along > 0.005
        assert abs(DEPTH @ error) < 5 * sd_along
        turned = estimate.pose.world_from_root.rotation * truth.rotation.inv()
        assert np.degrees(turned.magnitude()) < 2
