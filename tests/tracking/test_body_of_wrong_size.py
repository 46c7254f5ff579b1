"""A model that is 5 % too large or too small is tracked, with errors that its own size explains."""

import numpy as np
import pytest

from airborne.body import human18
from tests.support.people import HUMAN, mean_errors_mm, person, tracker
from tests.support.scenes import statuses, track

SCENE = person()


@pytest.mark.parametrize("size", [0.95, 1.05])
def test_person_of_another_size_is_tracked_with_an_error_of_that_size(size):
    model = human18(1.80 * size, 75.0 * size**3)
    estimates = track(SCENE, range(4), tracker(SCENE, model=model))
    assert statuses(estimates) == ["tracked"] * 4
    same_pose_mm = 1000 * np.linalg.norm(
        model.with_pose(SCENE.start()).landmarks - HUMAN.with_pose(SCENE.start()).landmarks, axis=1
    )
    off_mm = mean_errors_mm(SCENE, estimates, model)
    assert 15 < same_pose_mm.mean() < 60
    assert off_mm.max() < 1.5 * same_pose_mm.mean()
    assert off_mm.min() > 5 > mean_errors_mm(SCENE, track(SCENE, range(1), tracker(SCENE))).max()
