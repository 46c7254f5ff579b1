"""A camera's frames were converted to another frame rate: each blends two, and shows the body twice."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.sync.camera_equations import share_equations
from airborne.sync.mixed_frames import blend_of
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from airborne.video import View
from tests.support.scenes import CAMERAS, CROSS, FPS, Scene, thrown

SCENE = Scene(cameras=CAMERAS[:2])
APART = 2  # frames between the two that are blended
INSTANTS_S = np.arange(-3, 4) * APART / FPS / 2


@pytest.fixture(scope="module")
def blends():
    """The first camera's blends, by the share of the later instant."""
    frames = [SCENE.frames(index) for index in range(5, 23)]
    tracker = RefinedTracker(CROSS, thrown(frames[0].time_s))
    state = tracker.init()
    for each in frames[:4]:
        state, _ = step(tracker, state, each)

    def blend(share: float):
        equations = []
        for now, later in zip(frames, frames[APART:], strict=False):
            mixed = (1 - share) * now.views[0].rgb + share * later.views[0].rgb
            view = View(now.views[0].camera, np.rint(mixed).astype(np.uint8))
            poses = [thrown(now.time_s + Fraction(float(s))) for s in INSTANTS_S]
            equations.append(share_equations(tracker, state, view, poses))
        return blend_of(INSTANTS_S, *(np.array(each) for each in zip(*equations, strict=True)))

    return {share: blend(share) for share in (0.0, 0.3, 0.5, 1.0)}


def test_both_instants_are_found_with_their_shares(blends):
    for share in (0.3, 0.5):
        assert blends[share].is_mixed
        share_at = dict(zip(np.round(INSTANTS_S * FPS / APART, 1), blends[share].share, strict=True))
        assert abs(share_at[0.0] - (1 - share)) < 0.15
        assert abs(share_at[1.0] - share) < 0.15


def test_the_centre_of_the_blend_is_found(blends):
    for share, blend in blends.items():
        assert abs(blend.centre_s - share * APART / FPS) < 3e-3
        assert abs(blend.centre_s - share * APART / FPS) < 4 * blend.sd_s + 2e-4


def test_clear_frames_are_not_taken_for_blended_ones(blends):
    assert not blends[0.0].is_mixed
    assert not blends[1.0].is_mixed


def test_a_body_seen_too_seldom_gives_nothing():
    few = blend_of(INSTANTS_S, np.zeros((3, 7, 7)), np.zeros((3, 7)))
    invisible = blend_of(INSTANTS_S, np.zeros((20, 7, 7)), np.zeros((20, 7)))
    for blend in (few, invisible):
        assert np.isnan([blend.centre_s, blend.sd_s]).all()
        assert not blend.is_mixed


def test_exact_equations_give_the_shares_exactly():
    rng = np.random.default_rng(1)
    rows, share = rng.normal(size=(20, 7, 40)), np.array([0, 0, 0, 0.7, 0, 0.3, 0])
    A = rows @ np.swapaxes(rows, 1, 2)
    blend = blend_of(INSTANTS_S, A, 0.8 * A @ share)  # the image may be darker than the model
    np.testing.assert_allclose(blend.share, share, atol=1e-6)
    assert blend.is_mixed
    assert blend.sd_s < 1e-6


def test_what_only_the_farthest_instants_show_is_no_second_body():
    """A shadow, say: the body is farthest away there, and takes what nothing else explains."""
    shares = np.array([0.06, 0, 0.05, 0.75, 0.08, 0, 0.06]), np.array([0.06, 0.1, 0.05, 0.65, 0.08, 0, 0.06])
    A = np.broadcast_to(np.eye(7), (20, 7, 7))
    assert [blend_of(INSTANTS_S, A, A @ share).is_mixed for share in shares] == [False, True]
