"""A net of another height than was stated is named with the height that fits, and nothing else is."""

import re

import numpy as np
import pytest

from airborne.calibration.diagnosis.net import check_net
from airborne.calibration.sources.control_points import ControlPoints
from airborne.calibration.sources.court import court_points
from airborne.cameras import Rig, camera_looking_at

SIZE = (1920, 1080)
RIG = Rig(
    tuple(
        camera_looking_at(f"cam{k}", np.array([x, -14.0, 5.0]), np.array([0.0, 0.0, 1.0]), focal_px=1500.0, size=SIZE)
        for k, x in enumerate((-6.0, 0.0, 6.0))
    )
)


def clicked(stated, true, seed=0):
    """Clicks on a court whose net is at `true` [m], with the positions of one that was stated."""
    net, rng = court_points(true), np.random.default_rng(seed)
    world = np.array([point.position_m for point in net.values()])
    px = np.stack([camera.px_from_world(world) for camera in RIG], axis=1)
    of_stated = np.array([point.position_m for point in court_points(stated).values()])
    px = px + rng.normal(0, 0.7, px.shape)
    return ControlPoints(names=tuple(net), world=of_stated, cameras=RIG.names, px=px)


@pytest.mark.parametrize(("stated", "true"), [("women", 2.43), ("men", 2.24), (2.0, 2.35)])
def test_the_height_that_fits_is_named(stated, true):
    (found,) = check_net(RIG, clicked(stated, true), most_px=4.0)
    fits = float(re.search(r"a net at (.*?) m fits", found.sentence)[1])
    assert fits == pytest.approx(true, abs=0.02)
    assert found.sentence.startswith("court: only the net's points miss")


def test_of_a_right_net_and_of_a_wrong_floor_nothing_is_said():
    right = clicked("men", 2.43)
    assert check_net(RIG, right, most_px=4.0) == []
    mixed = clicked("women", 2.43)
    mixed.px[[0, 8]] = mixed.px[[8, 0]]
    assert check_net(RIG, mixed, most_px=4.0) == []
