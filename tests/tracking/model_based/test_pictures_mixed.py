"""A camera's pictures were converted to another frame rate: each is mixed from two, and shows the body twice."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.tracking.model_based.mixed_frames import blend_of
from airborne.tracking.model_based.refined import Refined
from airborne.tracking.tracker import step
from airborne.video import View
from tests.support.scenes import CAMERAS, CROSS, FPS, Scene, thrown

SCENE = Scene(cameras=CAMERAS[:2])
APART = 2  # frames between the two that are mixed
MOMENTS_S = np.arange(-3, 4) * APART / FPS / 2


@pytest.fixture(scope="module")
def shown():
    """What the first camera's pictures say, by the share of the later moment that is mixed in."""
    frames = [SCENE.frames(index) for index in range(5, 23)]
    tracker = Refined(CROSS, thrown(frames[0].time_s))
    state = tracker.init()
    for each in frames[:4]:
        state, _ = step(tracker, state, each)

    def blend(share: float):
        equations = []
        for now, later in zip(frames, frames[APART:], strict=False):
            mixed = (1 - share) * now.views[0].rgb + share * later.views[0].rgb
            view = View(now.views[0].camera, np.rint(mixed).astype(np.uint8))
            poses = [thrown(now.time_s + Fraction(float(s))) for s in MOMENTS_S]
            equations.append(tracker.by_moment(state, view, poses))
        return blend_of(MOMENTS_S, *(np.array(each) for each in zip(*equations, strict=True)))

    return {share: blend(share) for share in (0.0, 0.3, 0.5, 1.0)}


def test_both_moments_are_found_with_their_shares(shown):
    for share in (0.3, 0.5):
        assert shown[share].is_mixed
        found = dict(zip(np.round(MOMENTS_S * FPS / APART, 1), shown[share].share, strict=True))
        assert abs(found[0.0] - (1 - share)) < 0.15
        assert abs(found[1.0] - share) < 0.15


def test_the_middle_of_what_is_shown_is_found(shown):
    for share, blend in shown.items():
        assert abs(blend.centre_s - share * APART / FPS) < 3e-3
        assert abs(blend.centre_s - share * APART / FPS) < 4 * blend.sd_s + 2e-4


def test_clear_pictures_are_not_taken_for_mixed_ones(shown):
    assert not shown[0.0].is_mixed
    assert not shown[1.0].is_mixed


def test_a_body_seen_too_seldom_says_nothing():
    few = blend_of(MOMENTS_S, np.zeros((3, 7, 7)), np.zeros((3, 7)))
    unseen = blend_of(MOMENTS_S, np.zeros((20, 7, 7)), np.zeros((20, 7)))
    for blend in (few, unseen):
        assert np.isnan([blend.centre_s, blend.sd_s]).all()
        assert not blend.is_mixed


def test_exact_equations_give_the_shares_exactly():
    rng = np.random.default_rng(1)
    rows, share = rng.normal(size=(20, 7, 40)), np.array([0, 0, 0, 0.7, 0, 0.3, 0])
    A = rows @ np.swapaxes(rows, 1, 2)
    blend = blend_of(MOMENTS_S, A, 0.8 * A @ share)  # the picture may be darker than the model
    np.testing.assert_allclose(blend.share, share, atol=1e-6)
    assert blend.is_mixed
    assert blend.sd_s < 1e-6
