"""A limb that is misplaced by 90 degrees covers pixels unlike the body; it is detected by them and found again."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.appearance.model import Appearance
from airborne.body import Pose
from airborne.body.chain import clamp_to_limits
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, limb_of_segment
from airborne.tracking.model_based.fitter import Fitter
from airborne.tracking.model_based.gauss_newton import Posteriors
from airborne.tracking.model_based.global_search import region_evidence
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.misplaced_limbs import find_misplaced_limbs, search_limb
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.tracker import step
from tests.support.bodies import is_within_limits
from tests.support.people import HUMAN, mean_errors_mm, person, tracker
from tests.support.scenes import statuses, track

SCENE = person()
FOLDS = {
    "upper_arm_left": (0, -np.pi / 2, 0),
    "upper_arm_right": (-np.pi / 2, 0, 0),
    "thigh_right": (-np.pi / 2, 0, 0),
}
SHARED = 33.0  # pixels that count as one, as in a fit to this scene
FOREARM = {"forearm_right": (-np.pi / 2, 0, 0)}


def fold(pose: Pose, name: str, turn) -> Pose:
    angles = pose.joint_angles.copy()
    angles[HUMAN.index_of(name) - 1] += turn
    return clamp_to_limits(HUMAN, replace(pose, joint_angles=angles))


class LearnedFrame:
    """The second frame, with colours and background models learned from the true poses."""

    def __init__(self):
        self.render_model, self.truth, self.frames = RenderModel.of(HUMAN), SCENE.start(1), SCENE.frames(1)
        self.appearance = Appearance()
        for index in (0, 1):
            body = self.render_model.with_pose(SCENE.start(index))
            for region in crop_regions([body], self.render_model.geometry, SCENE.frames(index), 32):
                mask = self.render_model.draw_parts(body, region) >= 0
                self.appearance = self.appearance.learn_colours(region, mask).learn_background(region, mask)

    def views(self, pose):
        """The regions that hold the truth and a pose, and their posteriors."""
        bodies = [self.render_model.with_pose(each) for each in (pose, self.truth)]
        regions = crop_regions(bodies, self.render_model.geometry, self.frames, 32)
        return regions, [self.appearance.posterior(region) for region in regions]

    def off_mm(self, pose, limb):
        """How far the limb's joints are from the truth, at most."""
        estimated, true = HUMAN.with_pose(pose).t[limb], HUMAN.with_pose(self.truth).t[limb]
        return 1000 * float(np.linalg.norm(estimated - true, axis=1).max())


@pytest.fixture(scope="module")
def frame():
    return LearnedFrame()


def limb_with(name):
    limbs = limb_of_segment(HUMAN)
    return np.flatnonzero(limbs == limbs[HUMAN.index_of(name)])


def test_no_limb_of_the_true_pose_is_misplaced(frame):
    found = find_misplaced_limbs(frame.render_model, frame.truth, *frame.views(frame.truth))
    assert (found.suspect, found.misplaced) == ([], [])


@pytest.mark.parametrize(("name", "turn"), [*FOLDS.items(), *FOREARM.items()])
def test_limb_that_is_folded_wrong_is_misplaced_and_no_other(frame, name, turn):
    wrong = fold(frame.truth, name, turn)
    found = find_misplaced_limbs(frame.render_model, wrong, *frame.views(wrong))
    for (limb,) in found:
        np.testing.assert_array_equal(limb, limb_with(name))


@pytest.mark.parametrize(("probability", "is_misplaced"), [(0.3, False), (0.0, True)])
def test_limb_before_what_looks_like_it_is_suspect_and_misplaced_only_before_what_does_not(
    frame, probability, is_misplaced
):
    regions, posteriors = frame.views(frame.truth)
    part = frame.render_model.draw_parts(frame.render_model.with_pose(frame.truth), regions[0])
    is_thigh = (part >= 0) & (frame.render_model.segment_of_part[part] == HUMAN.index_of("thigh_right"))
    posteriors[0] = np.where(is_thigh, np.float32(probability), posteriors[0])
    found = find_misplaced_limbs(frame.render_model, frame.truth, regions, posteriors)
    assert [limb.tolist() for limb in found.suspect] == [limb_with("thigh_right").tolist()]
    assert len(found.misplaced) == is_misplaced


@pytest.mark.parametrize("name", FOLDS)
def test_search_for_a_limb_brings_it_near_and_moves_nothing_else(frame, name):
    wrong, limb = fold(frame.truth, name, FOLDS[name]), limb_with(name)
    poses = search_limb(frame.render_model, [wrong], limb, region_evidence(*frame.views(wrong)), shared=SHARED)
    assert frame.off_mm(wrong, limb) > 450
    assert frame.off_mm(poses[0], limb) < 150
    others = np.setdiff1d(np.arange(len(HUMAN.segments)), limb)
    for pose in poses:
        np.testing.assert_array_equal(HUMAN.with_pose(pose).t[others], HUMAN.with_pose(wrong).t[others])
        assert is_within_limits(HUMAN, pose)


@pytest.mark.parametrize("name", FOLDS)
def test_limb_that_has_clearly_most_evidence_where_it_is_has_no_other_place(frame, name):
    args = frame.render_model, [frame.truth], limb_with(name), region_evidence(*frame.views(frame.truth))
    assert search_limb(*args, shared=SHARED) == [frame.truth]
    assert len(search_limb(*args, shared=1e9)) > 1  # all evidence is next to none


@pytest.mark.parametrize("name", ["upper_arm_left", "thigh_right", "forearm_right"])
def test_start_with_one_limb_folded_wrong_is_put_right_in_the_first_frame(name):
    estimates = track(SCENE, range(1), tracker(SCENE, fold(SCENE.start(), name, (FOLDS | FOREARM)[name])))
    assert statuses(estimates) == ["tracked"]
    assert mean_errors_mm(SCENE, estimates).max() < 5


@pytest.mark.parametrize("names", [("upper_arm_left",), ("thigh_right", "upper_arm_left")])
def test_limbs_that_are_not_where_they_were_expected_are_moved_and_stay(frame, names):
    expected = frame.truth
    for name in names:
        expected = fold(expected, name, FOLDS[name])
    prior = PosePrior(expected, np.full(HUMAN.n_dofs, 0.1))
    learned = LearnedRegions(Posteriors(*frame.views(expected)), frame.appearance)
    fitter = Fitter.of(frame.render_model, "refined", fixed_shape=False)
    judged = fitter.judge(fitter.fit_images([expected], learned, prior), [expected], learned, prior)
    for name in names:
        assert frame.off_mm(expected, limb_with(name)) > 450
        assert frame.off_mm(judged.fit.pose, limb_with(name)) < 60


def test_limb_is_searched_for_once_where_both_directions_have_it_in_one_place(frame):
    expected = fold(frame.truth, "upper_arm_left", FOLDS["upper_arm_left"])
    prior, limb = PosePrior(expected, np.full(HUMAN.n_dofs, 0.1)), limb_with("upper_arm_left")
    learned = LearnedRegions(Posteriors(*frame.views(expected)), frame.appearance)
    fitter = Fitter.of(frame.render_model, "refined", fixed_shape=False)
    fit = fitter.fit_images([expected], learned, prior)
    again = fitter.judge(fit, [expected], learned, prior, searched=fit.pose)
    assert again.fit is fit and set(limb) <= set(again.agreement.misplaced)
    for searched in (None, frame.truth):  # nowhere, or where the limb is elsewhere
        judged = fitter.judge(fit, [expected], learned, prior, searched=searched)
        assert frame.off_mm(judged.fit.pose, limb) < 60


def test_limb_that_was_expected_stays_where_one_colour_shows_no_better_place(frame):
    expected = frame.truth
    prior = PosePrior(expected, np.full(HUMAN.n_dofs, 0.1))
    learned = LearnedRegions(Posteriors(*frame.views(expected)), frame.appearance)
    fitter = Fitter.of(frame.render_model, "refined", fixed_shape=False)
    folded = [fold(expected, name, turn) for name, turn in FOLDS.items()]
    judged = fitter.judge(fitter.fit_images([expected], learned, prior), folded, learned, prior)
    assert frame.off_mm(judged.fit.pose, np.arange(len(HUMAN.segments))) < 20


@pytest.fixture(scope="module")
def followed():
    """A tracker, what it knows after two frames, and the third."""
    followed = tracker(SCENE, SCENE.start())
    state = followed.init()
    for index in range(2):
        state, _ = step(followed, state, SCENE.frames(index))
    return followed, state, SCENE.frames(2)


@pytest.mark.parametrize("name", [None, "upper_arm_left", "thigh_right"])
def test_of_a_pose_found_otherwise_only_limbs_on_something_else_are_unknown(followed, name):
    tracker_of_scene, state, frames = followed
    pose = SCENE.start(2) if name is None else fold(SCENE.start(2), name, FOLDS[name])
    covariance = tracker_of_scene.assess(state, frames, ((frames.time_s, pose),)).covariance
    is_open = ~np.isfinite(np.diagonal(covariance)).reshape(-1, 3).all(axis=1)[1:]  # of each segment's rotation
    np.testing.assert_array_equal(np.flatnonzero(is_open), [] if name is None else limb_with(name))
