"""A person's skin becomes as thick as images show, about the joints where they were found."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, human18, with_girths
from airborne.body.shaping import half_size_m, with_segment_lengths
from airborne.body.skin import stretch_skin
from airborne.body_fitting.skin import fit_skin
from tests.support.motions import figure
from tests.support.scenes import CAMERAS, FPS, Scene, standing

GIRTHS = {"thigh": 0.88, "shank": 1.08, "upper_arm": 1.1, "torso": (1.06, 0.94), "chest": (0.95, 1.05)}
BODY = with_segment_lengths(human18(1.75, 70.0), {"thigh": 1.04})  # as it was tracked, its girths not right
TIMES = (0, 5, 10)


def moving(time_s: Fraction) -> Pose:
    """Arms and legs apart, turning."""
    t, names = float(time_s), [segment.name for segment in BODY.segments[1:]]
    angles = {"upper_arm_left": (-0.5, -0.9 + t, 0), "upper_arm_right": (0.4, 0.8, 0), "forearm_left": (-0.7, 0, 0)}
    angles |= {"thigh_left": (-0.6 + t, -0.2, 0), "thigh_right": (0.2, 0.2, 0), "shank_right": (0.4 + t, 0, 0)}
    root = RigidTransform.from_components([0.3 * t, 0.1, 1.45], Rotation.from_euler("xyz", [0.1, 0, 2 * t]))
    return Pose(world_from_root=root, joint_angles=np.array([angles.get(name, (0, 0, 0)) for name in names], float))


@pytest.fixture(scope="module")
def found():
    """Frames of a person with other girths, and the pose in each."""
    scene = Scene(model=with_girths(stretch_skin(BODY), GIRTHS), motion=moving, cameras=CAMERAS[:3], reach=0.3)
    return [(scene.frames(index), moving(Fraction(index, FPS))) for index in TIMES]


def half_m(model, segment):
    """Half the size of a segment along its axes [m]."""
    return np.max([half_size_m(part) for part in model.segments[model.index_of(segment)].parts], axis=0)


def test_girths_are_those_of_the_person_and_joints_stay(found):
    skin, true = fit_skin(BODY, found), with_girths(stretch_skin(BODY), GIRTHS)
    for segment in ("thigh_left", "shank_right", "upper_arm_left", "torso", "chest"):
        np.testing.assert_allclose(half_m(skin, segment), half_m(true, segment), rtol=0.06)
    for own, given in zip(skin.segments, BODY.segments, strict=True):
        np.testing.assert_array_equal(own.joint_m, given.joint_m)
        assert own.limits == given.limits


def test_a_body_that_the_frames_do_not_show_has_no_skin(found):
    by = RigidTransform.from_translation([90.0, 0, 0])
    away = [(frames, replace(pose, world_from_root=by * pose.world_from_root)) for frames, pose in found]
    assert fit_skin(BODY, away) is None
    assert fit_skin(BODY, []) is None


def test_a_body_that_is_drawn_as_ellipsoids_keeps_them():
    scene = Scene(model=BODY, motion=moving, cameras=CAMERAS[:3], reach=0.3)
    assert fit_skin(BODY, [(scene.frames(index), moving(Fraction(index, FPS))) for index in TIMES]) is None


def test_a_body_that_is_no_person_has_no_skin(found):
    assert fit_skin(figure(), [(frames, standing(Fraction(0))) for frames, _ in found]) is None
