import numpy as np
import pytest
from tests.tracking.people import mean_errors_mm, person, tracker
from tests.tracking.scenes import statuses, track
from tests.tracking.test_limb_astray import folded

SCENE = person()
AXES = {"forearm_left": (-1, 0, 0), "forearm_right": (-1, 0, 0), "upper_arm_right": (-1, 0, 0),
        "upper_arm_left": (0, -1, 0), "shank_left": (1, 0, 0), "shank_right": (1, 0, 0),
        "thigh_right": (-1, 0, 0), "thigh_left": (1, 0, 0)}


@pytest.mark.parametrize("deg", [45, 90])
@pytest.mark.parametrize("name", AXES)
def test_start_with_one_limb_folded_wrong_is_put_right_or_not_called_tracked(name, deg):
    start = folded(SCENE.start(), name, np.radians(deg) * np.array(AXES[name]))
    estimates = track(SCENE, range(1), tracker(SCENE, start))
    assert mean_errors_mm(SCENE, estimates).max() < 8 or statuses(estimates) != ["tracked"]
