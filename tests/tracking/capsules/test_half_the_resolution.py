"""Evidence in nats and what follows from it does not depend on the resolution of the images."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.first_frame import fit_first_frame
from airborne.tracking.capsules.kernel_arguments import NOBODY
from airborne.video import Frames, View
from tests.support.jumping_scenes import CAMERAS, Hall, hop


@pytest.fixture(scope="module")
def frames_by_resolution():
    """The same scene at about 130 and at about 65 pixels a metre."""
    fine = tuple(replace(each, K=np.array([[1200.0, 0, 239.5], [0, 1200.0, 119.5], [0, 0, 1.0]])) for each in CAMERAS)
    hall = Hall({"anna": hop((0.35, 0.0))}, cameras=fine)
    sharp = hall.frames(0)
    views = []
    for view in sharp.views:
        half = cv2.resize(view.rgb, (240, 120), interpolation=cv2.INTER_AREA)
        views.append(View(view.camera.resample(scale=(2, 2), offset=(0.5, 0.5), size=(240, 120)), half))
    return hall, sharp, Frames(0, sharp.time_s, tuple(views))


def test_nats_are_about_the_same(frames_by_resolution):
    hall, *both = frames_by_resolution
    fits = [fit_first_frame("anna", hall.starts()[0].joints_m, frames, NOBODY) for frames in both]
    assert [each.scale.reduction for each in fits] == [2, 1]
    assert fits[1].fit.nats == pytest.approx(fits[0].fit.nats, rel=0.15)


def test_joints_and_their_sd_are_about_the_same(frames_by_resolution):
    hall, *both = frames_by_resolution
    estimates = []
    for frames in both:
        blocker = Blocker(hall.starts())
        estimates.append(blocker.step(blocker.init(), frames)[1][0])
    sharp, coarse = estimates
    assert np.linalg.norm(coarse.points[:6] - sharp.points[:6], axis=1).max() < 0.02
    sd = [np.sqrt(np.trace(each.covariance[:6], axis1=1, axis2=2)) for each in estimates]
    np.testing.assert_allclose(sd[1], sd[0], rtol=0.3)
