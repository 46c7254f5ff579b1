"""A round thing with stripes and a handle: its outline does not tell how it is turned, its colours do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body import Box, Ellipsoid
from airborne.body.model import WHOLE
from airborne.tracking.model_based.refined import RefinedTracker
from tests.support.scenes import BLUE, RED, WHITE, YELLOW, Scene, errors, part, rigid_body, statuses, track

N = 8
RADII = np.array([0.2, 0.2, 0.2])


def slice_of_ball(name, low, high, colour):
    return replace(part(name, Ellipsoid(RADII), (0, 0, 0), colour), slab_m=(low, high))


STRIPED = rigid_body(
    slice_of_ball("bottom", WHOLE[0], -0.08, BLUE),
    slice_of_ball("middle", -0.08, 0.06, WHITE),
    slice_of_ball("top", 0.06, WHOLE[1], RED),
    part("handle", Box(np.array([0.16, 0.03, 0.04])), (0, 0, 0.22), YELLOW),
)


@pytest.mark.parametrize("tipped_deg", [0, 30, 60, 80])
def test_ball_with_stripes_does_not_turn_under_its_outline_in_two_views(tipped_deg):
    scene, tip = Scene(model=STRIPED), Rotation.from_euler("x", tipped_deg, degrees=True)
    thrown = scene.motion
    scene = replace(scene, cameras=scene.cameras[:2], motion=lambda time_s: _tipped(thrown(time_s), tip))
    estimates = track(scene, range(N), RefinedTracker(STRIPED, scene.start()))
    assert statuses(estimates) == ["tracked"] * N
    assert max(errors(scene, estimate)[1] for estimate in estimates) < 10


def _tipped(pose, tip):
    root = pose.world_from_root
    return replace(pose, world_from_root=type(root).from_components(root.translation, root.rotation * tip))
