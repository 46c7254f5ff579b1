"""Points of a posed body move with its shape and pose as their derivatives say."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import ATHLETE, Pose, human18
from airborne.body.chain import move_pose
from airborne.body.outfits import Border, ellipsoid_of
from airborne.body.skin import stretch_skin
from airborne.body_fitting.shape import apply_shape, border_parameters, shape_parameters
from airborne.body_fitting.shape_motion import ShapeMotion

BODY = human18(1.7, 65.0, outfit=ATHLETE)
PARAMETERS = (*shape_parameters(BODY), *border_parameters(BODY, {"thigh": Border(0.5), "head": Border(0.5, 1)}))
STEP = 1e-5


def a_pose():
    rng = np.random.default_rng(3)
    root = RigidTransform.from_components([0.2, -0.1, 1.2], Rotation.from_rotvec([0.4, -0.3, 0.8]))
    return Pose(world_from_root=root, joint_angles=rng.uniform(-0.4, 0.4, (len(BODY.segments) - 1, 3)))


def surface_points(shape, pose, at):
    """Points of every segment's ellipsoid, at shares `at` (3,) of its semi-axes: (segments, 3) world."""
    model = apply_shape(BODY, PARAMETERS, shape)
    posed = model.with_pose(pose)
    solids = [ellipsoid_of(model, segment.name) for segment in model.segments]
    local = np.array([centre + at * solid.semi_axes_m for solid, centre in solids])
    return np.einsum("sij,sj->si", posed.R, local) + posed.t, posed


def test_a_skin_moves_with_its_girths_as_their_derivatives_say():
    skin, pose = stretch_skin(human18()), a_pose()
    parameters = tuple(each for each in shape_parameters(skin) if each.kind == "girth")
    motion, posed = ShapeMotion.of(skin, parameters), skin.with_pose(pose)

    def vertices(shape):
        model = apply_shape(skin, parameters, shape)
        local = [part.segment_from_part.apply(part.shape.vertices_m) for part in model.parts]
        return [points @ posed.R[k].T + posed.t[k] for points, k in zip(local, owners, strict=True)]

    owners = [k for k, segment in enumerate(skin.segments) for _ in segment.parts]
    J, here = motion.surface_jacobian(posed), vertices(np.zeros(len(parameters)))
    for index in range(len(parameters)):
        ahead, back = (vertices(sign * STEP * np.eye(len(parameters))[index]) for sign in (1, -1))
        for k, points, end, start in zip(owners, here, ahead, back, strict=True):
            found = J[k, :3, index] + (points - posed.t[0]) @ J[k, 3:12, index].reshape(3, 3).T
            np.testing.assert_allclose(found, (end - start) / (2 * STEP), atol=1e-6)


@pytest.mark.parametrize("is_shape", [True, False])
def test_surfaces_and_landmarks_move_as_their_derivatives_say(is_shape):
    shape, pose, at = np.linspace(-0.1, 0.1, len(PARAMETERS)), a_pose(), np.array([0.3, -0.6, 0.5])
    points, posed = surface_points(shape, pose, at)
    motion = ShapeMotion.of(posed.model, PARAMETERS)
    J, J_marks = motion.surface_jacobian(posed), motion.landmark_jacobian(posed)
    o = points - posed.t[0]
    k = len(PARAMETERS)
    for index in range(k) if is_shape else range(k, J.shape[-1]):
        ends = []
        for step in (STEP, -STEP):
            if is_shape:
                ends.append(surface_points(shape + step * np.eye(k)[index], pose, at))
            else:
                ends.append(surface_points(shape, move_pose(pose, step * np.eye(J.shape[-1] - k)[index - k]), at))
        found = J[:, :3, index] + np.einsum("sij,sj->si", J[:, 3:12, index].reshape(-1, 3, 3), o)
        np.testing.assert_allclose(found, (ends[0][0] - ends[1][0]) / (2 * STEP), atol=1e-6)
        marks = (ends[0][1].landmarks - ends[1][1].landmarks) / (2 * STEP)
        np.testing.assert_allclose(J_marks[..., index], marks, atol=1e-6)
