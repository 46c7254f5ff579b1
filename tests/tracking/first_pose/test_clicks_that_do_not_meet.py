"""A start's clicks whose cameras are exchanged, or made in images of another size, are named; others are not."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18
from airborne.cameras import Rig, camera_looking_at
from airborne.errors import TrialError
from airborne.tracking.first_pose import fit_to_pixels
from airborne.tracking.first_pose.click_mix_up import explain_misses

MODEL = human18(1.75, 70.0)
NAMES = [mark.name for mark in MODEL.landmarks]
PLACES = {"left": [3.0, -4.0, 1.5], "right": [-3.0, -4.5, 1.2], "above": [0.5, -3.0, 4.0]}
RIG = Rig(
    tuple(camera_looking_at(name, at, [0, 0, 1.0], focal_px=900, size=(1280, 720)) for name, at in PLACES.items())
)
ONES = np.ones((len(NAMES), len(RIG)))


@pytest.fixture(scope="module")
def px():
    """Clicks 2 px off."""
    pose = Pose(
        world_from_root=RigidTransform.from_translation([0, 0, 1.0]), joint_angles=np.zeros((MODEL.n_joints, 3))
    )
    points = MODEL.with_pose(pose).landmarks
    px = np.stack([camera.px_from_world(points) for camera in RIG], axis=1)
    return px + np.random.default_rng(0).normal(0, 2, px.shape)


def test_careful_clicks_are_not_explained(px):
    assert explain_misses(RIG, px, ONES) == ""
    assert not fit_to_pixels(MODEL, RIG, "start", names=NAMES, px=px, weights=ONES).doubts


def test_columns_of_two_cameras_exchanged_are_named(px):
    assert "with the points of left and above exchanged they do" in explain_misses(RIG, px[:, [2, 1, 0]], ONES)


@pytest.mark.parametrize(("factor", "size"), [(0.5, "half as large"), (2.0, "twice as large")])
def test_images_of_another_size_are_named_also_where_no_pose_fits(px, factor, size):
    clicked = (px + 0.5) * factor - 0.5
    with pytest.raises(TrialError, match=f"start: .* as points of images {size} as the videos' they do"):
        fit_to_pixels(MODEL, RIG, "start", names=NAMES, px=clicked, weights=ONES)


def test_clicks_of_no_body_are_not_explained():
    clicked = np.random.default_rng(1).uniform(100, 600, (len(NAMES), len(RIG), 2))
    assert explain_misses(RIG, clicked, ONES) == ""
