"""A body that moves by several pixels while an image is exposed."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.rendering.packing import pack_view
from airborne.synthetic.throw.pictures import scene_frames
from airborne.tracking.model_based.exposure import Exposure, bodies_in_exposure
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.tracker import step
from tests.support.synthetic import small_scene

EXPOSURE_S = 0.016
SCENE = small_scene("side-somersault", scale=2, n_pictures=8, exposure_s=EXPOSURE_S, noise_sd=2.0)


@pytest.fixture(scope="module")
def frames():
    return list(scene_frames(SCENE))


def error_mm(frames, exposure_s):
    truth = SCENE.flight(np.array([float(SCENE.time_s(each.index)) for each in frames]))
    tracker = RefinedTracker(SCENE.model, truth.pose(0))
    state, squares = tracker.init(), []
    for each in frames:
        views = tuple(replace(view, exposure_s=exposure_s) for view in each.views)
        state, estimate = step(tracker, state, replace(each, views=views))
        off_m = estimate.pose.world_from_root.translation - truth.pose(each.index).world_from_root.translation
        squares.append(1e6 * off_m @ off_m)
    return np.sqrt(np.mean(squares[3:]))


def test_it_is_measured_better_where_the_exposure_is_known(frames, monkeypatch):
    monkeypatch.setattr("airborne.tracking.model_based.refined._BLUR_FRAMES", 0)  # or motion is taken for a lens's blur
    assert error_mm(frames, EXPOSURE_S) < 0.92 * error_mm(frames, 0.0)


def test_of_an_unknown_exposure_the_blur_is_taken_for_the_lens(frames, monkeypatch):
    learned = error_mm(frames, 0.0)
    monkeypatch.setattr("airborne.tracking.model_based.refined._BLUR_FRAMES", 0)
    assert learned < 0.8 * error_mm(frames, 0.0)


def test_poses_of_an_exposure_lie_evenly_about_its_middle():
    body = RenderModel.of(SCENE.model)
    pose, velocity = SCENE.flight(np.zeros(1)).pose(0), np.array([3.0, 0.0, 0.0])

    def move(pose, s):
        return pose.move(velocity * s, np.zeros(3))

    camera = SCENE.rig.cameras[0]
    exposure = Exposure(EXPOSURE_S, pack_view(camera), camera.K)
    bodies = bodies_in_exposure(body, pose, move, exposure)
    along_m = np.array([each.t[0] - body.with_pose(pose).t[0] for each in bodies])[:, 0]
    assert len(bodies) > 2
    assert along_m.mean() == pytest.approx(0, abs=1e-12)
    assert np.diff(along_m) == pytest.approx(3.0 * EXPOSURE_S / len(bodies))
    still = bodies_in_exposure(body, pose, lambda pose, s: pose, exposure)
    assert len(still) == 1
