"""Behind a body that stays over the same pixels for most of a run, the scene is what the other pictures show."""

import numpy as np

from airborne.body import Pose
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.empty_scenes import EmptyScenes, _upper_median, _without_body
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.registration import draw_silhouette
from airborne.video import Frames, View
from tests.support.scenes import CAMERAS, CROSS, FPS, Scene

SCENE = Scene(cameras=CAMERAS[:1])
HERE = SCENE.start(0)
AWAY = HERE.move(np.array([0.0, 0.0, 50.0]), np.zeros(3))  # in no picture


def behind(poses: list[Pose]):
    """The scene behind the body at the first of some poses, its silhouette, and the true scene there."""
    render_model, camera = RenderModel.of(CROSS), SCENE.cameras[0]
    rng = np.random.default_rng(3)
    width, height = camera.size
    empty = rng.integers(0, 256, (height, width, 3)).astype(np.uint8)
    kept = []
    for index, pose in enumerate(poses):
        rgb = empty.copy()
        rgb[render_model.draw(render_model.with_pose(pose), camera).part >= 0] = 90
        kept.append(Frames(index, SCENE.frames(index).time_s, (View(camera, rgb),)))
    path = TrackedPath(np.arange(len(poses)), np.arange(len(poses)) / FPS, poses, np.zeros((len(poses), 6, 6)))
    silhouette = draw_silhouette(render_model, render_model.with_pose(poses[0]), camera)
    assert silhouette is not None
    x0, y0, x1, y1 = silhouette.box
    return EmptyScenes(kept, render_model, path).behind(0, kept[0].views[0], silhouette), empty[y0:y1, x0:x1]


def test_three_pictures_without_the_body_show_the_scene_behind_it():
    found, true = behind([HERE] * 5 + [AWAY] * 3)
    np.testing.assert_array_equal(found, true)


def test_two_do_not():
    assert behind([HERE] * 6 + [AWAY] * 2)[0] is None


def test_what_is_covered_moves_no_median():
    rng = np.random.default_rng(5)
    for n in (4, 7, 8):
        images = rng.integers(0, 256, (n, 30, 40, 3)).astype(np.uint8)
        covered = rng.random((n, 30, 40)) < 0.4
        covered[0] = False
        bare = np.where(covered[..., None], np.nan, images)
        found = _upper_median(_without_body(images.copy(), covered))
        others = np.sort(bare, axis=0)  # NaN last
        n_bare = np.sum(~covered, axis=0)[..., None]
        low, high = (
            np.take_along_axis(others, (k)[None].repeat(3, -1), 0)[0] for k in ((n_bare - 1) // 2, n_bare // 2)
        )
        assert np.all((found == low) | (found == high))
