"""A person who moves arms and legs is followed, from a start that is wrong in every joint."""

import numpy as np
import pytest

from tests.support.bodies import is_within_limits
from tests.support.people import HUMAN, mean_errors_mm, person, tracker, wrong
from tests.support.scenes import statuses, track

SCENE = person()


@pytest.mark.parametrize("method", ["refined", "hierarchical", "joint"])
def test_every_order_of_fitting_finds_the_person_from_a_start_three_degrees_off(method):
    start = wrong(SCENE.start(), off_m=0.025, off_deg=3.0)
    off_mm = np.linalg.norm(HUMAN.with_pose(start).landmarks - HUMAN.with_pose(SCENE.start()).landmarks, axis=1) * 1000
    assert off_mm.mean() > 20
    estimates = track(SCENE, range(5), tracker(SCENE, start, method=method))
    assert statuses(estimates) == ["tracked"] * 5
    assert mean_errors_mm(SCENE, estimates).max() < 5.0
    for estimate in estimates:
        assert estimate.n_views == 3
        assert is_within_limits(HUMAN, estimate.pose, slack_rad=np.radians(3.0))


@pytest.mark.parametrize("seed", [1, 2])
def test_where_the_start_is_wrong_does_not_matter(seed):
    estimates = track(SCENE, range(2), tracker(SCENE, wrong(SCENE.start(), seed=seed)))
    assert statuses(estimates) == ["tracked"] * 2
    assert mean_errors_mm(SCENE, estimates).max() < 5
