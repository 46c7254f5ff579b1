import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.cameras import Camera
from airborne.video.undistortion import undistortion_of
from tests.support.clips import plain_camera

BARREL = (-0.25, 0.05, 0.002, -0.001, 0.0)
SIZE = (160, 120)


def spots(camera, points):
    """An image with a round spot at each point's pixel, in single rows of the camera's own grid."""
    x, y = np.meshgrid(np.arange(camera.size[0]), np.arange(camera.size[1]))
    image = sum(np.exp(-((x - u) ** 2 + (y - v) ** 2) / 8) for u, v in camera.px_from_world(points))
    return np.repeat((250 * np.clip(image, 0, 1)).astype(np.uint8)[..., None], 3, axis=2)


def centroid(image, near, radius=7):
    x, y = np.meshgrid(np.arange(image.shape[1]), np.arange(image.shape[0]))
    weight = image[..., 0] * ((x - near[0]) ** 2 + (y - near[1]) ** 2 < radius**2)
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


@pytest.mark.parametrize("parity", [None, 0, 1])
def test_points_lie_on_the_straight_image_where_the_straight_camera_sees_them(parity):
    camera = plain_camera(size=SIZE, distortion=BARREL)
    if parity is not None:
        camera = camera.field(parity)
    points = np.array([[-0.3, -0.2, 1], [0.3, -0.2, 1], [0.3, 0.2, 1], [-0.3, 0.22, 1], [0.02, 0.01, 1]])
    view = undistortion_of(camera).view(spots(camera, points))
    assert not view.camera.is_distorted
    straight_px = view.camera.px_from_world(points)
    assert np.max(np.abs(straight_px - camera.px_from_world(points))) > 1
    for px in straight_px:
        assert np.linalg.norm(centroid(view.rgb, px) - px) < 0.1


def test_an_image_without_distortion_is_passed_on_untouched():
    camera = plain_camera(size=SIZE)
    image = np.zeros((120, 160, 3), np.uint8)
    assert undistortion_of(camera).view(image).rgb is image


def test_a_lens_that_moves_no_pixel_by_a_twentieth_is_left_alone():
    camera = plain_camera(size=SIZE, distortion=BARREL)
    assert undistortion_of(camera).px_from_undistorted is not None
    faint = undistortion_of(replace(camera, distortion=np.array(BARREL) / 10_000))
    assert faint.px_from_undistorted is None
    assert not faint.camera.is_distorted


def test_the_laboratorys_lenses_need_straightening_only_where_they_move_pixels(shared_data):
    with open(shared_data("balance") / "Pose2Sim_cameras.toml", "rb") as file:
        tables = [table for table in tomllib.load(file).values() if "matrix" in table]
    assert len(tables) == 4
    for table in tables:
        size = (int(table["size"][0]), int(table["size"][1]))
        coefficients = np.array([*table["distortions"], 0.0])
        camera = Camera(
            name=table["name"],
            K=np.array(table["matrix"]),
            size=size,
            camera_from_world=RigidTransform.identity(),
            distortion=coefficients,
        )
        corner = np.array([[[0, 0], [size[0] - 1, 0], [0, size[1] - 1], [size[0] - 1, size[1] - 1]]], float)
        xy = np.concatenate([corner - camera.K[:2, 2], np.zeros((1, 4, 1))], -1) / [camera.K[0, 0], camera.K[1, 1], 1]
        moved = np.linalg.norm(camera.px_from_world(xy + np.array([0, 0, 1])) - corner, axis=-1).max()
        assert (undistortion_of(camera).px_from_undistorted is not None) == (moved > 0.05)
