"""A limb of which the model is elsewhere stands out uncovered, and no view shows one that the body does not need."""

import numpy as np
import pytest

from airborne.tracking.model_based.support import count_views, mark_unobserved, widen_unseen
from airborne.tracking.model_based.uncovered import find_uncovered_pixels
from tests.support.people import HUMAN
from tests.tracking.test_misplaced_limb import FOLDS, LearnedFrame, fold

NAMES = [segment.name for segment in HUMAN.segments]


@pytest.fixture(scope="module")
def frame():
    return LearnedFrame()


def uncovered_px(frame, pose):
    render_model = frame.render_model
    posed = render_model.with_pose(pose)
    return [int(each.sum()) for each in find_uncovered_pixels(render_model, posed, *frame.views(pose))]


def test_nothing_stands_out_of_the_true_pose(frame):
    assert uncovered_px(frame, frame.truth) == [0, 0, 0]


@pytest.mark.parametrize("name", FOLDS)
def test_limb_that_the_model_has_elsewhere_stands_out_in_two_views(frame, name):
    assert sum(px > 0 for px in uncovered_px(frame, fold(frame.truth, name, FOLDS[name]))) >= 2


def test_views_show_the_limbs_of_the_true_pose(frame):
    regions, _ = frame.views(frame.truth)
    counts = count_views(frame.render_model, frame.truth, regions, frame.appearance)
    long = [NAMES.index(f"{name}_{side}") for name in ("thigh", "shank", "forearm") for side in ("left", "right")]
    assert np.all(counts[long] >= 2)


def test_no_view_shows_a_forearm_where_there_is_none(frame):
    wrong = fold(frame.truth, "upper_arm_left", FOLDS["upper_arm_left"])
    regions, _ = frame.views(wrong)
    counts = count_views(frame.render_model, wrong, regions, frame.appearance)
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
