"""A body that leaves every image is tracked as long as it is visible, then lost."""

import numpy as np
import pytest

from airborne.body import surface_arrays
from airborne.rendering import FLAT, render
from airborne.tracking.methods import Settings, tracker_of
from tests.support.scenes import CAMERAS, CROSS, Scene, errors, statuses, thrown, track

FRAMES = 14


def upward(time_s):
    return thrown(time_s).move(np.array([0, 0, 7.0 * float(time_s)]), np.zeros(3))


LEAVING = Scene(motion=upward)


def visible_share(index):
    """The share of the body that is inside the images, over all cameras."""
    flat, posed = surface_arrays(CROSS), CROSS.with_pose(LEAVING.start(index))
    masks = [render(flat, posed, camera, FLAT).mask.sum() for camera in CAMERAS]
    whole = [
        render(flat, posed, camera.resample(scale=(1, 1), offset=(-800, -800), size=(1920, 1840)), FLAT).mask.sum()
        for camera in CAMERAS
    ]
    return sum(masks) / sum(whole)


def test_body_is_tracked_while_it_is_visible_and_lost_when_it_is_gone():
    shares = [visible_share(index) for index in range(FRAMES)]
    assert shares[0] == 1
    assert shares[-1] == 0
    estimates = track(LEAVING, range(FRAMES))
    for share, estimate in zip(shares, estimates, strict=True):
        if share == 1:
            assert estimate.status == "tracked"
            assert errors(LEAVING, estimate)[0] < 3
        elif share == 0:
            assert estimate.status == "lost"
        elif estimate.status == "tracked":
            assert errors(LEAVING, estimate)[0] < 20


@pytest.mark.parametrize("method", ["stepping", "simplex"])
def test_paper_bs_searches_lose_it_too_and_do_not_break(method):
    settings = Settings(method=method, loops=((0.02, 0.04), (0.01, 0.02)))
    estimates = track(LEAVING, range(FRAMES), tracker_of(settings, CROSS, LEAVING.start()))
    assert statuses(estimates)[0] == "tracked"
    assert statuses(estimates)[-1] == "lost"
