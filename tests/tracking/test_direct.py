"""Paper B's searches find the body by a colour difference inside the mask."""

import numpy as np
import pytest

from airborne.tracking.methods import Settings, tracker_of
from tests.tracking.scenes import CROSS, Scene, statuses, track, worst

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


def test_reduced_pictures_are_good_enough():
    settings = Settings(method="simplex", scale=2)
    assert worst(SCENE, track(SCENE, range(2), tracker_of(settings, CROSS, SCENE.start())))[0] < 8
