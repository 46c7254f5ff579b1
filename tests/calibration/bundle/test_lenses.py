"""Projection and its derivatives."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.calibration.bundle.lenses import project, project_with_jacobian
from tests.support.rigs import BROWN, FISHEYE, MIDDLE, ring
from tests.support.tolerances import EXACT


def numbers(lens, n=6):
    rng = np.random.default_rng(0)
    rig = ring(n, distortion=BROWN if lens == "brown" else FISHEYE, lens=lens)
    R = np.stack([c.camera_from_world.rotation.as_matrix() for c in rig])
    centre = np.stack([c.centre for c in rig])
    inner = np.stack([[c.K[0, 0], 1.01 * c.K[1, 1], *c.K[:2, 2], *np.resize([*c.distortion, 0.01], 8)] for c in rig])
    if lens == "fisheye":
        inner[:, 8:] = 0
    return rig, R, centre, inner, np.full(n, lens == "fisheye"), rng.uniform(-0.5, 0.5, (n, 3)) + MIDDLE


@pytest.mark.parametrize("lens", ["brown", "fisheye"])
def test_pixels_are_those_of_the_camera(lens):
    rig, R, centre, inner, is_fisheye, world = numbers(lens)
    inner[:, 1] = inner[:, 0]
    inner[:, 4:] = np.stack([np.pad(c.distortion, (0, 8 - len(c.distortion))) for c in rig])
    expected = np.stack([camera.px_from_world(point) for camera, point in zip(rig, world, strict=True)])
    np.testing.assert_allclose(project(R, centre, inner, is_fisheye=is_fisheye, world=world), expected, rtol=1e-12)


@pytest.mark.parametrize("lens", ["brown", "fisheye"])
def test_slopes_are_those_of_differences(lens):
    _, R, centre, inner, is_fisheye, world = numbers(lens)
    px, by_camera, by_world = project_with_jacobian(R, centre, inner, is_fisheye=is_fisheye, world=world)
    np.testing.assert_allclose(px, project(R, centre, inner, is_fisheye=is_fisheye, world=world), rtol=EXACT)
    for number in range(18):
        width = 1e-3 if 6 <= number < 10 else 1e-6

        def moved(step, number=number):
            change = np.zeros(18)
            change[number] = step
            turned = Rotation.from_rotvec(change[:3]).as_matrix() @ R
            return project(turned, centre + change[3:6], inner + change[6:], is_fisheye=is_fisheye, world=world)

        expected = (moved(width) - moved(-width)) / (2 * width)
        scale = 1 + np.abs(expected).max()
        np.testing.assert_allclose(by_camera[:, :, number] / scale, expected / scale, atol=1e-7)
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        ahead = project(R, centre, inner, is_fisheye=is_fisheye, world=world + step)
        behind = project(R, centre, inner, is_fisheye=is_fisheye, world=world - step)
        np.testing.assert_allclose(by_world[:, :, axis], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-3)


def test_behind_the_camera_there_is_no_pixel_and_no_slope():
    _, R, centre, inner, is_fisheye, _ = numbers("brown")
    behind = centre - 2 * R[:, 2]
    px, by_camera, by_world = project_with_jacobian(R, centre, inner, is_fisheye=is_fisheye, world=behind)
    assert np.isnan(px).all()
    assert not by_camera.any()
    assert not by_world.any()
