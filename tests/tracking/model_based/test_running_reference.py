"""A mask is judged by what was learned before its frame, and so is the running reference that it is compared with."""

from dataclasses import replace

import pytest

from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from tests.support.scenes import Scene


def test_reference_moves_a_fifth_of_the_way_to_the_shares_of_the_search():
    scene = Scene()
    tracker = RefinedTracker(scene.model, scene.start())
    state, _ = step(tracker, tracker.init(), scene.frames(0))
    estimate = tracker.search(state, scene.frames(1))
    assert estimate.mask_shares is not None and min(estimate.mask_shares) > 0.8
    after = tracker.learn(state, scene.frames(1), replace(estimate, mask_shares=(0.5, 0.25))).reference
    expected = (0.8 * state.reference.precision + 0.2 * 0.5, 0.8 * state.reference.recall + 0.2 * 0.25)
    assert (after.precision, after.recall) == pytest.approx(expected)
