"""A limb of which the model is elsewhere stands out uncovered, and no view shows one that the body does not need."""

import numpy as np
import pytest

from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import all_joints, limbs_of, pair_of_segment
from airborne.tracking.model_based.fitter import Fitter
from airborne.tracking.model_based.gauss_newton import Posteriors, image_evaluator
from airborne.tracking.model_based.image_views import make_image_views
from airborne.tracking.model_based.learned_regions import LearnedRegions
from airborne.tracking.model_based.mask_faults import find_mask_faults
from airborne.tracking.model_based.support import count_views, mark_unobserved, widen_unseen
from airborne.tracking.model_based.uncovered import find_uncovered
from tests.support.people import HUMAN
from tests.tracking.test_misplaced_limb import FOLDS, LearnedFrame, fold

ARMS = pair_of_segment(HUMAN)[HUMAN.index_of("forearm_left")]
NAMES = [segment.name for segment in HUMAN.segments]


@pytest.fixture(scope="module")
def frame():
    return LearnedFrame()


def uncovered_px(frame, pose):
    render_model = frame.render_model
    posed = render_model.with_pose(pose)
    return [int(each.sum()) for each in find_uncovered(render_model, posed, *frame.views(pose)).pixels]


def test_nothing_stands_out_of_the_true_pose(frame):
    assert uncovered_px(frame, frame.truth) == [0, 0, 0]


@pytest.mark.parametrize("name", FOLDS)
def test_limb_that_the_model_has_elsewhere_stands_out_in_two_views(frame, name):
    assert sum(px > 0 for px in uncovered_px(frame, fold(frame.truth, name, FOLDS[name]))) >= 2


def test_what_stands_uncovered_is_measured_and_has_a_nearest_segment(frame):
    render_model = frame.render_model
    wrong = fold(frame.truth, "thigh_right", FOLDS["thigh_right"])
    beside_m2, of_truth_m2 = (
        find_uncovered(render_model, render_model.with_pose(pose), *frame.views(pose)).beside_m2
        for pose in (wrong, frame.truth)
    )
    assert of_truth_m2.max() == 0
    per_m2 = np.array(uncovered_px(frame, wrong))
    assert np.all((beside_m2.sum(axis=1) > 0) >= (per_m2 > 0)) and beside_m2.max() > 6e-4


def test_joints_of_a_limb_beside_which_something_stands_uncovered_are_worth_one_view(frame):
    fitter = Fitter.of(frame.render_model, "refined", fixed_shape=False)
    most = {}
    for name, pose in (("true", frame.truth), ("wrong", fold(frame.truth, "thigh_right", FOLDS["thigh_right"]))):
        learned = LearnedRegions(Posteriors(*frame.views(pose)), frame.appearance)
        fit = fitter.fit_images([pose], learned, None)
        faults = find_mask_faults(fitter.render_model, fit, learned)
        agreement = fitter._assess(faults, faults.limbs.suspect, learned).agreement  # nothing is mended
        assert agreement.n_views_of is not None
        most[name] = [int(agreement.n_views_of[limb].max()) for limb in limbs_of(HUMAN)]
    assert min(most["true"]) >= 2
    assert min(most["wrong"]) <= 1


def test_fit_in_which_no_limb_moves_is_looked_through_once(frame, monkeypatch):
    looked_through = []

    def find(*args):
        looked_through.append(args)
        return find_uncovered(*args)

    monkeypatch.setattr("airborne.tracking.model_based.mask_faults.find_uncovered", find)
    fitter = Fitter.of(frame.render_model, "refined", fixed_shape=False)
    learned = LearnedRegions(Posteriors(*frame.views(frame.truth)), frame.appearance)
    fit = fitter.fit_images([frame.truth], learned, None)
    judged = fitter.judge(fit, [frame.truth], learned, None)
    assert len(looked_through) == 1 and judged.fit is fit


def views_that_show(frame, pose):
    regions, _ = frame.views(pose)
    views = make_image_views(frame.render_model, regions, frame.appearance)
    evaluate, _ = image_evaluator(frame.render_model, [pose], views, dofs=all_joints(HUMAN))
    return count_views(frame.render_model, pose, views, evaluate(pose, True).noise_of_views)


def test_views_show_the_limbs_of_the_true_pose(frame):
    counts = views_that_show(frame, frame.truth)
    long = [NAMES.index(f"{name}_{side}") for name in ("thigh", "shank", "forearm") for side in ("left", "right")]
    assert np.all(counts[long] >= 2)


def test_no_view_shows_a_forearm_where_there_is_none(frame):
    wrong = fold(frame.truth, "upper_arm_left", FOLDS["upper_arm_left"])
    counts = views_that_show(frame, wrong)
    assert counts[NAMES.index("forearm_left")] < 2


def test_unseen_segments_widen_their_own_joints_alone():
    covariance = np.eye(HUMAN.n_dofs) * 1e-4
    n_views = np.full(len(NAMES), 3)
    none, one = NAMES.index("shank_left"), NAMES.index("forearm_right")
    n_views[[none, NAMES.index("foot_left")]], n_views[[one, NAMES.index("hand_right")]] = 0, 1
    sd = np.sqrt(np.diag(widen_unseen(covariance, HUMAN, n_views)))
    assert np.all(np.isinf(sd[3 + 3 * none : 6 + 3 * none]))
    assert np.all((sd[3 + 3 * one : 6 + 3 * one] > 0.2) & (sd[3 + 3 * one : 6 + 3 * one] < 0.8))
    np.testing.assert_allclose(sd[:6], 0.01)


def test_segment_whose_next_one_is_shown_keeps_its_covariance():
    n_views = np.full(len(NAMES), 3)
    n_views[NAMES.index("upper_arm_left")] = 0
    covariance = np.eye(HUMAN.n_dofs)
    np.testing.assert_array_equal(widen_unseen(covariance, HUMAN, n_views), covariance)


def test_what_is_marked_unobserved_is_infinite_and_uncorrelated():
    marked = mark_unobserved(np.full((4, 4), 2.0), np.array([1]))
    assert marked[1, 1] == np.inf
    np.testing.assert_array_equal(marked[1, [0, 2, 3]], 0)
    np.testing.assert_array_equal(marked[np.ix_([0, 2, 3], [0, 2, 3])], 2)


@pytest.fixture
def appearance_with_arms(frame):
    render_model, appearance = frame.render_model, frame.appearance
    body, pairs = render_model.with_pose(frame.truth), pair_of_segment(HUMAN)
    for region in crop_regions([body], render_model.geometry, frame.frames, 32):
        part = render_model.draw_parts(body, region)
        appearance = appearance.learn_limb_colours(region, part, np.append(pairs[render_model.segment_of_part], -1))
    return appearance


def test_what_an_arm_covers_has_to_look_like_an_arm(frame, appearance_with_arms):
    """Any of the body's colours is evidence for the body; for an arm, those of arms are."""
    render_model, posed = frame.render_model, frame.render_model.with_pose(frame.truth)
    for region in crop_regions([posed], render_model.geometry, frame.frames, 32):
        part = render_model.draw_parts(posed, region)
        owner = np.append(render_model.segment_of_part, -1)[part]
        own = appearance_with_arms.limb_posterior(region, ARMS)
        any_of_body = appearance_with_arms.posterior(region)
        for names, is_like_arm in ((("forearm_left", "hand_left"), True), (("pelvis", "thigh_left"), False)):
            pixels = np.isin(owner, [HUMAN.index_of(name) for name in names])
            rises = np.median(own[pixels] - any_of_body[pixels])
            assert (rises >= -1e-3) == is_like_arm, (region.camera.name, names, rises)
