"""A body that its prediction holds where it is not is fitted again, freer of it; its pelvis is turned, too."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body.chain import clamp_to_limits, joint_angles_of
from airborne.body.sides import are_crossed
from airborne.tracking.model_based import gauss_newton, turned_pelvis
from airborne.tracking.model_based.degrees_of_freedom import PosePrior
from airborne.tracking.model_based.fitter import Fitter
from airborne.tracking.model_based.gauss_newton import Posteriors
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.turned_pelvis import is_twisted, turn_pelvis_back
from tests.support.people import HUMAN
from tests.tracking.test_misplaced_limb import LearnedFrame

NARROW = np.repeat([0.02, 0.05, 0.05], [3, 3, 3 * HUMAN.n_joints])
WHOLE = np.arange(len(HUMAN.segments))
LEG = ("thigh", "shank", "foot_")
LEGS = np.array([HUMAN.index_of(f"{name}_{side}") for name in ("thigh", "shank") for side in ("left", "right")])


@pytest.fixture(scope="module")
def frame():
    return LearnedFrame()


@pytest.fixture(scope="module")
def fitter(frame):
    return Fitter.of(frame.render_model, "refined", fixed_shape=False)


def judge_held(frame, fitter, wrong):
    """The fit that a narrow prior holds at a wrong pose, and what is judged of it."""
    learned, prior = LearnedRegions(Posteriors(*frame.views(wrong)), frame.appearance), PosePrior(wrong, NARROW)
    held = fitter.fit_images([wrong], learned, prior)
    return held, fitter.judge(held, [wrong], learned, prior)


def turn_pelvis(pose):
    """The poses among which a turned pelvis is looked for: the root turned about its long axis, limbs aiming alike."""
    turns = turned_pelvis._turn(HUMAN, pose, turned_pelvis._TURNS_RAD, np.arange(len(HUMAN.segments)))
    return turned_pelvis._poses(pose, *turns)


def slide(pose, by_m=0.12):
    """The pose moved along the trunk."""
    root = pose.world_from_root
    moved = root.translation + by_m * root.rotation.as_matrix()[:, 2]
    return replace(pose, world_from_root=RigidTransform.from_components(moved, root.rotation))


def test_body_that_slid_along_itself_is_found(frame, fitter):
    held, judged = judge_held(frame, fitter, slide(frame.truth))
    assert frame.off_mm(held.pose, WHOLE) > 100
    assert frame.off_mm(judged.fit.pose, WHOLE) < 10


def test_turned_pelvis_leaves_the_trunk_and_where_legs_point(frame):
    before = HUMAN.with_pose(frame.truth)
    for pose in turn_pelvis(frame.truth):
        after = HUMAN.with_pose(pose)
        rest = [i for i in WHOLE if i != 0 and i not in LEGS and "foot" not in HUMAN.segments[i].name]
        np.testing.assert_allclose(after.t[rest], before.t[rest], atol=1e-12)
        np.testing.assert_allclose(after.R[rest], before.R[rest], atol=1e-12)
        for side in ("left", "right"):
            thigh, shank = (HUMAN.index_of(f"{name}_{side}") for name in ("thigh", "shank"))
            aim, leg = before.t[shank] - after.t[thigh], after.t[shank] - after.t[thigh]
            np.testing.assert_allclose(np.cross(aim, leg), 0, atol=1e-12)
            np.testing.assert_allclose(after.R[shank], before.R[shank], atol=1e-12)


def test_pelvis_that_is_turned_turns_back(frame, fitter):
    held, judged = judge_held(frame, fitter, turn_pelvis(frame.truth)[-1])
    assert frame.off_mm(held.pose, LEGS) > 60
    assert frame.off_mm(judged.fit.pose, LEGS) < 10


def test_pelvis_turns_back_though_no_step_leads_there(frame, fitter, monkeypatch):
    monkeypatch.setattr(gauss_newton, "_MOST_STEPS", 1)
    monkeypatch.setattr(Fitter, "fit_silhouettes", lambda fitter, pose, learned, levels, prior: pose)
    held, judged = judge_held(frame, fitter, turn_pelvis(frame.truth)[-1])
    assert frame.off_mm(held.pose, LEGS) > 60
    assert frame.off_mm(judged.fit.pose, LEGS) < 20


def test_turned_back_pelvis_has_each_leg_where_the_other_was(frame):
    before = HUMAN.with_pose(frame.truth)
    for pose in turn_pelvis_back(HUMAN, frame.truth):
        after = HUMAN.with_pose(pose)
        for side, other in (("left", "right"), ("right", "left")):
            hip, knee = HUMAN.index_of(f"thigh_{side}"), HUMAN.index_of(f"shank_{side}")
            aim, leg = before.t[HUMAN.index_of(f"shank_{other}")] - after.t[hip], after.t[knee] - after.t[hip]
            np.testing.assert_allclose(np.cross(aim, leg), 0, atol=1e-12)
            np.testing.assert_allclose(after.R[knee], before.R[HUMAN.index_of(f"shank_{other}")], atol=1e-12)


def twist_trunk(pose, truth):
    """The pose with its trunk twisted joint by joint, as far as it goes, so that chest and arms point as they do."""
    for first in (HUMAN.index_of("chest"), HUMAN.index_of("head")):
        pose = clamp_to_limits(HUMAN, pose)
        R, rest = HUMAN.with_pose(pose).R, [i for i in WHOLE if i >= first and HUMAN.segments[i].name[:5] not in LEG]
        R[rest] = HUMAN.with_pose(truth).R[rest]
        pose = replace(pose, joint_angles=joint_angles_of(HUMAN, R, near=pose.joint_angles))
    return clamp_to_limits(HUMAN, pose)


@pytest.mark.parametrize("number", [3, 4])  # turned by 70 degrees, one way and the other
def test_legs_taken_for_each_other_are_exchanged_where_the_trunk_is_twisted(frame, fitter, number):
    wrong = twist_trunk(turn_pelvis_back(HUMAN, frame.truth)[number], frame.truth)
    assert not is_twisted(HUMAN, frame.truth)
    assert is_twisted(HUMAN, wrong)
    held, judged = judge_held(frame, fitter, wrong)
    assert frame.off_mm(held.pose, LEGS) > 100
    assert frame.off_mm(judged.fit.pose, LEGS) < 20


@pytest.mark.parametrize("number", [1, 3])  # turned by 130 and by 70 degrees
def test_crossed_legs_are_exchanged(frame, fitter, number):
    wrong = clamp_to_limits(HUMAN, turn_pelvis_back(HUMAN, frame.truth)[number])
    assert not are_crossed(HUMAN, HUMAN.with_pose(frame.truth).t)
    assert are_crossed(HUMAN, HUMAN.with_pose(wrong).t)
    assert not is_twisted(HUMAN, wrong)
    held, judged = judge_held(frame, fitter, wrong)
    assert frame.off_mm(held.pose, LEGS) > 100
    assert frame.off_mm(judged.fit.pose, LEGS) < 20
