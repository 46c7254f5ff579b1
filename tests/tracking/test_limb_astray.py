"""A limb that is folded wrong by 90 degrees lies on pixels unlike the body; it is told by them and found again."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.appearance.model import Appearance
from airborne.body import Pose
from airborne.tracking.image_regions import regions_round
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment, within_limits
from airborne.tracking.model_based.global_search import evidence_of
from airborne.tracking.model_based.misplaced_limbs import astray, look_for
from airborne.tracking.model_based.render_model import Synthesis
from tests.support.people import HUMAN, mean_errors_mm, person, tracker
from tests.support.scenes import statuses, track

SCENE = person()
FOLDS = {
    "upper_arm_left": (0, -np.pi / 2, 0),
    "upper_arm_right": (-np.pi / 2, 0, 0),
    "thigh_right": (-np.pi / 2, 0, 0),
}
FOREARM = {"forearm_right": (-np.pi / 2, 0, 0)}


def folded(pose: Pose, name: str, turn) -> Pose:
    angles = pose.joint_angles.copy()
    angles[HUMAN.index_of(name) - 1] += turn
    return within_limits(HUMAN, replace(pose, joint_angles=angles))


class Seen:
    """The second frame, its colours and scene known from the true poses."""

    def __init__(self):
        self.synthesis, self.truth, self.frames = Synthesis.of(HUMAN), SCENE.start(1), SCENE.frames(1)
        self._appearance = Appearance()
        for index in (0, 1):
            body = self.synthesis.place(SCENE.start(index))
            for region in regions_round([body], self.synthesis.geometry, SCENE.frames(index), 32):
                mask = self.synthesis.parts(body, region) >= 0
                self._appearance.learn_colours(region, mask)
                self._appearance.learn_scene(region, mask)

    def views(self, pose):
        """The regions that hold the truth and a pose, and their posteriors."""
        bodies = [self.synthesis.place(each) for each in (pose, self.truth)]
        regions = regions_round(bodies, self.synthesis.geometry, self.frames, 32)
        return regions, [self._appearance.posterior(region) for region in regions]

    def off_mm(self, pose, limb):
        """How far the limb's joints are from the truth, at most."""
        found, true = HUMAN.with_pose(pose).t[limb], HUMAN.with_pose(self.truth).t[limb]
        return 1000 * float(np.linalg.norm(found - true, axis=1).max())


@pytest.fixture(scope="module")
def seen():
    return Seen()


def limb_with(name):
    limbs = limb_of_segment(HUMAN)
    return np.flatnonzero(limbs == limbs[HUMAN.index_of(name)])


def test_no_limb_of_the_true_pose_is_astray(seen):
    assert astray(seen.synthesis, seen.truth, *seen.views(seen.truth)) == []


@pytest.mark.parametrize(("name", "turn"), [*FOLDS.items(), *FOREARM.items()])
def test_limb_that_is_folded_wrong_is_astray_and_no_other(seen, name, turn):
    wrong = folded(seen.truth, name, turn)
    (found,) = astray(seen.synthesis, wrong, *seen.views(wrong))
    np.testing.assert_array_equal(found, limb_with(name))


@pytest.mark.parametrize("name", FOLDS)
def test_looking_for_a_limb_brings_it_near_and_moves_nothing_else(seen, name):
    wrong, limb = folded(seen.truth, name, FOLDS[name]), limb_with(name)
    found = look_for(seen.synthesis, [wrong], limb, evidence_of(*seen.views(wrong)))
    assert seen.off_mm(wrong, limb) > 450
    assert seen.off_mm(found[0], limb) < 130
    others = np.setdiff1d(np.arange(len(HUMAN.segments)), limb)
    low, high = np.moveaxis(HUMAN.limits_rad, -1, 0)
    for pose in found:
        np.testing.assert_array_equal(HUMAN.with_pose(pose).t[others], HUMAN.with_pose(wrong).t[others])
        assert np.all((low <= pose.joint_angles) & (pose.joint_angles <= high))


@pytest.mark.parametrize("name", ["upper_arm_left", "thigh_right", "forearm_right"])
def test_start_with_one_limb_folded_wrong_is_put_right_in_the_first_frame(name):
    estimates = track(SCENE, range(1), tracker(SCENE, folded(SCENE.start(), name, (FOLDS | FOREARM)[name])))
    assert statuses(estimates) == ["tracked"]
    assert mean_errors_mm(SCENE, estimates).max() < 5
