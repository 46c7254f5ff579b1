"""An arm that is occluded by the trunk from every camera is not invented, and is found again when it comes out."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, surface_arrays
from airborne.rendering import FLAT, render
from tests.support.people import FOCAL_PX, HELD, HUMAN, PLACE, SWING, landmark_errors_mm, person, sd_rad, tracker
from tests.support.scenes import FPS, camera, statuses, track

SIDE = tuple(camera(f"side{i}", np.pi / 2 + turn, FOCAL_PX) for i, turn in enumerate((-0.25, 0.0, 0.25)))
FRAMES, HIDDEN, OUT_AGAIN = 17, (8, 9, 10), 14


def swing_arm(time_s: Fraction) -> Pose:
    """The right arm swings from in front to behind the trunk, rests there and comes out; the left one is held high."""
    t = float(time_s)
    out = np.interp(t * FPS, [0, 8, 10, 18], [1, 0, 0, 1])
    share = out * out * (3 - 2 * out)
    angles = HELD + 0.3 * SWING * np.sin(4 * t)
    fixed = {
        "upper_arm_right": (-0.1 - 0.7 * share, 0, 0),
        "forearm_right": (-0.3 * share, 0, 0),
        "upper_arm_left": (-2.4 - t, -0.2, 0),
        "forearm_left": (-0.3, 0, 0),
        "thigh_right": (0, 0, 0),
        "shank_right": (0.2, 0, 0),
    }
    for name, xyz in fixed.items():
        angles[HUMAN.index_of(name) - 1] = xyz
    turn = Rotation.from_euler("XYZ", [0.05, 0, 0.2 * t])
    return Pose(
        world_from_root=RigidTransform.from_components(PLACE + np.array([0.2, 0.1, 0.3]) * t, turn), joint_angles=angles
    )


SCENE = person(swing_arm, SIDE)


@pytest.fixture(scope="module")
def estimates():
    return track(SCENE, range(FRAMES), tracker(SCENE))


def off_mm(estimate, name):
    return landmark_errors_mm(SCENE, estimate)[[each.name for each in HUMAN.landmarks].index(name)]


def test_the_arm_is_occluded_in_the_scene():
    arm = [HUMAN.index_of(name) for name in ("upper_arm_right", "forearm_right", "hand_right")]

    def visible_px(index):
        drawn = [
            render(surface_arrays(HUMAN), HUMAN.with_pose(SCENE.start(index)), each, FLAT).segment for each in SIDE
        ]
        return max(np.count_nonzero(np.isin(segment, arm)) for segment in drawn)

    assert visible_px(0) > 200
    assert all(visible_px(index) < 25 for index in HIDDEN)


def test_occluded_arm_stays_near_where_it_went_and_is_found_when_it_comes_out(estimates):
    assert statuses(estimates) == ["tracked"] * FRAMES
    for estimate in estimates:
        is_occluded = 5 <= estimate.index < OUT_AGAIN
        assert off_mm(estimate, "hand_right") < (70 if is_occluded else 20)
        assert off_mm(estimate, "elbow_right") < (36 if is_occluded else 16)
        assert off_mm(estimate, "hand_left") < 12


def test_occluded_arm_is_not_claimed_to_be_known(estimates):
    for index in HIDDEN:
        assert np.all(sd_rad(estimates[index], "upper_arm_right") > 0.5)
        assert np.all(sd_rad(estimates[index], "forearm_right") > 0.5)
        assert np.all(sd_rad(estimates[index], "upper_arm_left") < 0.3)
    assert np.isfinite(sd_rad(estimates[0], "forearm_right")[0])
    assert np.isfinite(sd_rad(estimates[OUT_AGAIN], "forearm_right")[0])
