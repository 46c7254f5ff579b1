"""A suspect fit is searched for anew, unless it ends where the motion led; a poor one always is."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.tracking.model_based import refined
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.model_based.status import Reference
from airborne.tracking.tracker import step
from tests.support.scenes import FPS, Scene, difference

SCENE, BEFORE = Scene(), 3


@pytest.fixture(scope="module")
def tracked():
    tracker = RefinedTracker(SCENE.model, SCENE.start())
    state = tracker.init()
    for index in range(BEFORE):
        state, _ = step(tracker, state, SCENE.frames(index))
    return tracker, state, tracker.search(state, SCENE.frames(BEFORE))


@pytest.mark.parametrize(
    ("share_of_reference", "off_m", "expected"),
    [(0.99, 0.0, []), (0.9, 0.0, []), (0.9, 0.03, ["suspect"]), (0.7, 0.0, ["suspect"]), (0.7, 0.03, ["wrong"])],
)
def test_search_follows_from_the_mask_and_the_prediction(tracked, monkeypatch, share_of_reference, off_m, expected):
    tracker, state, found = tracked
    precision, recall = found.mask_shares
    reference = Reference(precision / share_of_reference, recall / 2, True)
    past = tuple(
        (Fraction(index, FPS), SCENE.start(index).move(np.array([off_m, 0, 0]), np.zeros(3))) for index in range(BEFORE)
    )
    searched = []

    def recover(*_, suspect=None, **__):
        searched.append("wrong" if suspect is None else "suspect")

    monkeypatch.setattr(refined, "recover", recover)
    estimate = tracker.search(replace(state, past=past, reference=reference), SCENE.frames(BEFORE))
    assert searched == expected
    assert difference(estimate.pose, SCENE.start(BEFORE))[0] < 3
