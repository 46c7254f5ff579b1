"""A limb that was found again is followed back to where it had been lost, and no further."""

import numpy as np
import pytest

from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import PosePrior
from airborne.tracking.model_based.fitter import Fitter
from airborne.tracking.model_based.limb_revision import follow_back
from tests.support.people import HUMAN
from tests.tracking.test_misplaced_limb import FOLDS, SCENE, LearnedFrame, fold, limb_with

NEWEST, ARM = 5, "upper_arm_left"


@pytest.fixture(scope="module")
def frame():
    learned = LearnedFrame()
    for index in range(2, NEWEST):
        body, frames = learned.render_model.with_pose(SCENE.start(index)), SCENE.frames(index)
        for region in crop_regions([body], learned.render_model.geometry, frames, 32):
            mask = learned.render_model.draw_parts(body, region) >= 0
            learned.appearance = learned.appearance.learn_colours(region, mask).learn_background(region, mask)
    return learned


def path_back(frame, found):
    """The path of the arm back from the newest frame, where it is found as it is; before, as `found` has it."""
    return follow_back(
        Fitter.of(frame.render_model, "refined", fixed_shape=False),
        limb_with(ARM),
        (SCENE.frames(NEWEST), SCENE.start(NEWEST)),
        [(SCENE.frames(index), pose) for index, pose in found.items()],
        appearance=frame.appearance,
        prior_of=lambda pose, gap_s: PosePrior(pose, np.full(HUMAN.n_dofs, 0.1)),
    )


def test_arm_that_was_lost_for_two_frames_is_put_where_it_was(frame):
    folded = {index: fold(SCENE.start(index), ARM, FOLDS[ARM]) for index in (4, 3)}
    path = path_back(frame, folded | {index: SCENE.start(index) for index in (2, 1)})
    assert [step.index for step in path] == [4, 3]
    for step in path:
        off_m = HUMAN.with_pose(step.fit.pose).t - HUMAN.with_pose(SCENE.start(step.index)).t
        assert 1000 * np.linalg.norm(off_m, axis=1).max() < 60


def test_arm_that_was_right_all_the_time_stays(frame):
    assert path_back(frame, {index: SCENE.start(index) for index in (4, 3)}) == []
