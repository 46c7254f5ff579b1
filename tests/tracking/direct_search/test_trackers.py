"""Paper B's searches find the body by a colour difference inside the mask."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.rendering import FLAT, RULES
from airborne.tracking import Status, predictors
from airborne.tracking.direct_search.trackers import DirectTracker, stepping_search
from airborne.tracking.methods import Settings, tracker_of
from airborne.video import Frames, View
from tests.support.scenes import CROSS, Scene, statuses, track, worst

SCENE = Scene()
LOOPS = ((0.02, 0.035), (0.01, 0.017), (0.005, 0.009))


@pytest.mark.parametrize("colour", ["raw", "normalised", "blend", "union"])
@pytest.mark.parametrize(("method", "most_mm", "most_deg"), [("stepping", 12, 4), ("simplex", 5, 2)])
def test_search_stays_with_the_body_whatever_the_colour_rule(method, colour, most_mm, most_deg):
    settings = Settings(method=method, colour=colour, loops=LOOPS)
    estimates = track(SCENE, range(3), tracker_of(settings, CROSS, SCENE.start()))
    assert statuses(estimates) == ["tracked"] * 3
    position_mm, rotation_deg = worst(SCENE, estimates)
    assert position_mm < most_mm
    assert rotation_deg < most_deg
    for estimate in estimates:
        assert estimate.n_views == 4
        assert 0 < estimate.score < 30
        variance = np.diag(estimate.covariance)
        assert np.all(variance > 0)
        assert method == "stepping" or np.all(variance[:3] < 0.01**2)  # stepping may end beside the minimum


def test_reduced_images_are_good_enough():
    settings = Settings(method="simplex", scale=2)
    assert worst(SCENE, track(SCENE, range(2), tracker_of(settings, CROSS, SCENE.start())))[0] < 8


@pytest.mark.parametrize("notices_loss", [True, False])
def test_run_without_a_sense_of_loss_goes_on_from_where_it_ended(notices_loss):
    search = stepping_search([np.repeat(steps, 3) for steps in LOOPS], "v_literal", (3, 4, 5, 2, 1, 0))
    start = SCENE.start()
    tracker = DirectTracker(
        CROSS,
        start,
        search,
        rule=RULES["normalised"],
        lights=FLAT,
        scale=1,
        predict=predictors.constant,
        notices_loss=notices_loss,
    )
    (frames,) = [SCENE.frames(0)]
    wall = tuple(View(view.camera, 255 - view.rgb) for view in frames.views if view is not None)
    other = Frames(1, Fraction(1, 50), wall)
    state = tracker.init()
    state = tracker.learn(state, frames, tracker.search(state, frames))
    estimate = tracker.search(state, other)
    assert (estimate.status is Status.LOST) == notices_loss
    later = tracker.learn(state, other, estimate)
    assert (len(later.past) == 1) == notices_loss
