"""While a mask agrees as well as usual, backgrounds are learned twice, then colours twice; otherwise both always."""

from dataclasses import replace

import pytest

from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from tests.support.scenes import Scene

SCENE = Scene()


@pytest.mark.parametrize(
    ("shares_of_reference", "expected"),
    [
        ((1.0, 1.0), ["background", "colours", "colours", "background", "background", "colours"]),
        ((0.9, 1.0), ["background, colours"] * 6),
        ((1.0, 0.9), ["background, colours"] * 6),
    ],
)
def test_what_is_learned_follows_from_the_mask(shares_of_reference, expected):
    tracker = RefinedTracker(SCENE.model, SCENE.start())
    state, estimate = step(tracker, tracker.init(), SCENE.frames(0))
    learned = []
    for _ in expected:
        precision, recall = (
            share * usual
            for share, usual in zip(
                shares_of_reference, (state.reference.precision, state.reference.recall), strict=True
            )
        )
        before = state.appearance
        state = tracker.learn(state, SCENE.frames(0), replace(estimate, mask_shares=(precision, recall)))
        is_learned = {
            "background": state.appearance.backgrounds is not before.backgrounds,
            "colours": state.appearance.body_histograms is not before.body_histograms,
        }
        learned.append(", ".join(name for name, is_new in is_learned.items() if is_new))
    assert learned == expected
