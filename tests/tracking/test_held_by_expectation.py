"""A body that its prediction holds where it is not is fitted again, freer of it; its pelvis is turned, too."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.tracking.model_based import gauss_newton
from airborne.tracking.model_based.degrees_of_freedom import PosePrior
from airborne.tracking.model_based.fitter import Fitter
from airborne.tracking.model_based.gauss_newton import Posteriors
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.turned_pelvis import turn_pelvis
from tests.support.people import HUMAN
from tests.tracking.test_misplaced_limb import LearnedFrame

NARROW = np.repeat([0.02, 0.05, 0.05], [3, 3, 3 * HUMAN.n_joints])
WHOLE = np.arange(len(HUMAN.segments))
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
    for pose in turn_pelvis(HUMAN, frame.truth):
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
    held, judged = judge_held(frame, fitter, turn_pelvis(HUMAN, frame.truth)[-1])
    assert frame.off_mm(held.pose, LEGS) > 60
    assert frame.off_mm(judged.fit.pose, LEGS) < 10


def test_pelvis_turns_back_though_no_step_leads_there(frame, fitter, monkeypatch):
    monkeypatch.setattr(gauss_newton, "_MOST_STEPS", 1)
    monkeypatch.setattr(Fitter, "fit_silhouettes", lambda fitter, pose, learned, levels, prior: pose)
    held, judged = judge_held(frame, fitter, turn_pelvis(HUMAN, frame.truth)[-1])
    assert frame.off_mm(held.pose, LEGS) > 60
    assert frame.off_mm(judged.fit.pose, LEGS) < 20
