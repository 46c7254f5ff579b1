"""Which player occludes which, from torsos alone."""

import numpy as np
import pytest

from airborne.tracking.particle.occlusion import is_torso_occluded, occlusion_share

CENTRE = np.array([0.0, -10.0, 1.2])
TORSO = np.array([0.0, 0.0, 1.2])


@pytest.mark.parametrize(
    "other, is_occluded",
    [
        ((0.0, -2.0, 1.2), True),
        ((0.35, -2.0, 1.2), True),
        ((0.5, -2.0, 1.2), False),  # beside the ray
        ((0.0, 1.0, 1.2), False),  # behind
        ((0.0, -12.0, 1.2), False),  # behind the camera
    ],
)
def test_a_torso_is_occluded_by_one_that_is_nearer_and_close_to_its_ray(other, is_occluded):
    assert is_torso_occluded(TORSO, CENTRE, np.array([other])) == is_occluded


def test_without_others_nothing_is_occluded():
    assert not is_torso_occluded(TORSO, CENTRE, np.zeros((0, 3)))
    assert not occlusion_share(np.zeros((2, 5, 3)), CENTRE, np.zeros((0, 3))).any()


def test_a_player_in_front_occludes_the_legs_on_his_side_only():
    left, right = np.linspace([-0.3, 0, 0.9], [-0.3, 0, 0.1], 7), np.linspace([0.3, 0, 0.9], [0.3, 0, 0.1], 7)
    in_front = np.array([[-0.2, -3.0, 1.2]])
    assert occlusion_share(np.stack([left, right]), CENTRE, in_front).tolist() == [1, 0]
    assert not occlusion_share(np.stack([left, right]), CENTRE, -in_front).any()


def test_a_jumper_in_front_occludes_only_what_is_as_high():
    leg = np.linspace([0, 0, 2.0], [0, 0, 0.0], 41)[None]
    high = np.array([[0.0, -1.0, 2.4]])  # his feet are 1.1 m above the floor
    share = occlusion_share(leg, CENTRE, high)
    assert 0.3 < share[0] < 0.6
