"""Left taken for right: legs that have changed sides are put right."""

import numpy as np
import pytest

from airborne.body import Pose
from airborne.body.chain import moved_pose
from airborne.tracking.swaps import is_nearer, swapped
from tests.tolerances import EXACT, ROUNDTRIP
from tests.tracking.people import HUMAN, mean_errors_mm, person, swinging, tracker, wrong
from tests.tracking.scenes import CROSS, FIGURE, standing, statuses, thrown, track

SCENE = person()
TRUTH = SCENE.start()
LEGS = {HUMAN.index_of(f"{each}_left"): HUMAN.index_of(f"{each}_right") for each in ("thigh", "shank", "foot")}
EITHER = [*LEGS, *LEGS.values()]
OTHERS = [i for i in range(len(HUMAN.segments)) if i not in EITHER]


def with_legs_swapped(pose: Pose) -> Pose:
    """The one of the two swaps in which the legs have changed sides."""
    joints = np.array(EITHER) - 1
    changed = [np.abs(each.joint_angles - pose.joint_angles)[joints].max() > ROUNDTRIP for each in swapped(HUMAN, pose)]
    assert sum(changed) == 1
    return swapped(HUMAN, pose)[changed.index(True)]


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_start_with_the_legs_swapped_is_put_right(seed):
    start = wrong(with_legs_swapped(TRUTH), seed=seed)
    far_mm = 1000 * np.linalg.norm(HUMAN.with_pose(start).t - HUMAN.with_pose(TRUTH).t, axis=1)
    assert far_mm.max() > 300
    estimates = track(SCENE, range(2), tracker(SCENE, start))
    assert statuses(estimates) == ["tracked"] * 2
    assert mean_errors_mm(SCENE, estimates).max() < 5
