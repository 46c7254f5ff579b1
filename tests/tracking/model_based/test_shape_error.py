"""Pixels that err together, as a person is no set of ellipsoids, say less of a pose than as many independent ones."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Pose
from airborne.body.model import Ellipsoid, Part, Segment
from airborne.tracking.model_based.degrees_of_freedom import all_joints, root_only
from airborne.tracking.model_based.gauss_newton import linearise_images
from airborne.tracking.model_based.shape_error import (
    SHAPE_SD_M,
    SHAPE_TURN_SD_RAD,
    SOFT_TURN_SD_RAD,
    shape_error_gradients,
    shape_gradients,
)
from tests.support.people import FOCAL_PX, HUMAN
from tests.tracking.test_misplaced_limb import LearnedFrame

WIDTH_M, DISTANCE_M = 0.075, 4.03  # along which the error is the same; from the cameras to the person
MIDDLE_M = np.array([0.1, 0.2, 0.3])
OF_BALL = Part("ball", Ellipsoid(np.ones(3)), RigidTransform.from_translation(MIDDLE_M), None)
BALL = BodyModel("ball", (Segment("ball", None, np.zeros(3), (OF_BALL,)),))
BLURRED_PX = 18.1  # 4 pi 1.2^2: how many pixels share the blurred noise


@pytest.fixture(scope="module")
def frame():
    return LearnedFrame()


@pytest.mark.parametrize(
    ("dofs", "shared_px"), [(root_only, BLURRED_PX), (all_joints, (WIDTH_M * FOCAL_PX / DISTANCE_M) ** 2)]
)
def test_pixels_within_a_limbs_width_share_their_error_where_joints_move(frame, dofs, shared_px):
    regions, _ = frame.views(frame.truth)
    equations = linearise_images(frame.render_model, frame.truth, regions, frame.appearance, dofs=dofs(HUMAN))
    assert equations.misfit / equations.noise == pytest.approx(shared_px / BLURRED_PX, rel=0.1)


def test_about_a_segments_own_axes_the_error_turns_with_it(frame):
    """The gradients by a segment's three axes are those by the world's, turned; their sum of squares is the same."""
    regions, _ = frame.views(frame.truth)
    dofs, posed = all_joints(HUMAN), frame.render_model.with_pose(frame.truth)
    equations = linearise_images(frame.render_model, frame.truth, regions, frame.appearance, dofs=dofs)
    n = len(posed.R)
    own = shape_gradients(equations, posed).reshape(n, 2, 3, -1)
    by_world = np.einsum("sjitp,tpd->sjid", equations.shifted[-1].reshape(n, 2, 3, n, 6), equations.J)
    is_soft = [segment.name in ("head", "pelvis") for segment in HUMAN.segments]
    by_world[is_soft, 1] *= SOFT_TURN_SD_RAD / SHAPE_TURN_SD_RAD
    np.testing.assert_allclose(np.einsum("sik,sjkd->sjid", posed.R, own), by_world, atol=1e-9 * abs(by_world).max())
    for kind in range(2):
        assert abs(own - by_world)[:, kind].max() > 0.1 * abs(by_world)[:, kind].max()


@pytest.mark.parametrize("n_views", [1, 4])
def test_segment_lies_beside_its_ellipsoid_alike_however_many_views_show_it(n_views):
    """The pose that the gradients ask for is the error: a shift by SHAPE_SD_M, a turn about the segment's middle."""
    root = np.random.default_rng(3).normal(size=(6, 6))
    A, posed = n_views * root @ root.T, BALL.with_pose(Pose(world_from_root=RigidTransform.identity()))
    twists = np.linalg.solve(A, shape_error_gradients(A[None], posed).reshape(-1, 6).T).T
    np.testing.assert_allclose(twists[:3], SHAPE_SD_M * np.eye(3, 6), atol=1e-9)
    np.testing.assert_allclose(twists[3:, 3:], SHAPE_TURN_SD_RAD * np.eye(3), atol=1e-9)
    np.testing.assert_allclose(twists[3:, :3] + np.cross(twists[3:, 3:], MIDDLE_M), np.zeros((3, 3)), atol=1e-9)
