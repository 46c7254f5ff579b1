"""A person who is gone, or not filmed, for a while is lost, with no numbers, and found again where they come back."""

import numpy as np
import pytest

from tests.support.people import mean_errors_mm, person, swinging, tracker
from tests.support.scenes import FPS, statuses, track

ABSENT = (3, 4, 5)
SCENES = {
    "all cameras dark": person(is_dark=lambda index, name: index in ABSENT),
    "the person gone": person(lambda time_s: None if time_s * FPS in ABSENT else swinging(time_s)),
}


@pytest.mark.parametrize("name", SCENES)
def test_person_is_lost_while_not_seen_and_found_in_the_next_picture(name):
    scene = SCENES[name]
    estimates = track(scene, range(8), tracker(scene))
    assert statuses(estimates) == ["lost" if index in ABSENT else "tracked" for index in range(8)]
    for estimate in (estimates[index] for index in ABSENT):
        assert estimate.pose is None
        assert estimate.covariance is None
        assert np.isnan(estimate.score)
    assert mean_errors_mm(scene, estimates).max() < 6.5
