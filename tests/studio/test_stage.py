"""The 3D scene shows what it is about."""

import numpy as np

from airborne.studio.stage import FROM, overview

HALF_VIEW = np.radians(75 / 2)  # three.js's


def test_all_cameras_are_in_view_even_on_one_side_of_what_they_look_at():
    cameras = np.array([[-6.9, -13.1, 4.6], [7.0, -13.0, 4.4], [-0.3, -15.0, 5.2], [0.0, 0.0, 1.0]])
    middle, away = overview(cameras)
    eye = middle + away * FROM
    ahead = (middle - eye) / np.linalg.norm(middle - eye)
    rays = (cameras - eye) / np.linalg.norm(cameras - eye, axis=1, keepdims=True)
    assert np.arccos(rays @ ahead).max() < HALF_VIEW
