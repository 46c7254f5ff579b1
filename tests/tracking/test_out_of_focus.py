"""A camera whose lens is out of focus."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from airborne.appearance.model import LENS_BLURS_PX
from airborne.synthetic.throw.pictures import scene_frames
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from tests.support.synthetic import small_scene

SCENE = small_scene("half-twist", scale=2, n_pictures=8, noise_sd=2.0)
BLUR_PX = 2.0


@cache
def frames_seen():
    return list(scene_frames(SCENE))


def _defocus(view, sd):
    aspect = view.camera.K[1, 1] / view.camera.K[0, 0]
    return replace(view, image=cv2.GaussianBlur(view.rgb, (0, 0), sd, sigmaY=sd * aspect))


def track(monkeypatch, blurs_px, is_known):
    """Return the error [mm] and the blurs that were learned, of views blurred by so much."""
    if not is_known:
        monkeypatch.setattr("airborne.appearance.model.LENS_BLURS_PX", (0.0,) * len(LENS_BLURS_PX))
    truth = SCENE.flight(np.array([float(SCENE.time_s(i)) for i in range(8)]))
    tracker = RefinedTracker(SCENE.model, truth.pose(0))
    state, squares, estimate = tracker.init(), [], None
    for frames in frames_seen():
        views = [_defocus(view, sd) for view, sd in zip(frames.views, blurs_px, strict=True)]
        frames = replace(frames, views=tuple(views))
        state, estimate = step(tracker, state, frames)
        off_m = estimate.pose.world_from_root.translation - truth.pose(frames.index).world_from_root.translation
        squares.append(1e6 * off_m @ off_m)
    model = tracker.render_model
    regions = crop_regions([model.with_pose(estimate.pose)], model.geometry, frames, 10)
    return np.sqrt(np.mean(squares[2:])), [state.appearance.blur_px(region) for region in regions]


@pytest.fixture(scope="module")
def sharp():
    return track(None, [0.01] * 3, is_known=True)


def test_the_blur_of_each_lens_is_found(monkeypatch, sharp):
    blurs = track(monkeypatch, [0.01, BLUR_PX, 0.01], is_known=True)[1]
    assert blurs[0] == sharp[1][0] and blurs[2] == sharp[1][2]
    assert blurs[0] <= 0.8 and blurs[2] <= 0.8 and 1.7 <= blurs[1] <= 2.5


def test_it_is_measured_better_where_the_blur_is_learned(monkeypatch):
    known, _ = track(monkeypatch, [BLUR_PX] * 3, is_known=True)
    unknown, _ = track(monkeypatch, [BLUR_PX] * 3, is_known=False)
    assert known < 0.8 * unknown
