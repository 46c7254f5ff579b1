from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.errors import CalibrationError
from tests.support.cameras import LENS, camera_at, scattered, three_cameras
from tests.support.tolerances import ROUNDTRIP


def test_a_camera_at_the_origin_stands_at_zero_and_not_at_minus_zero():
    turn = RigidTransform.from_rotation(Rotation.from_euler("xyz", [10, 20, 30], degrees=True))
    assert not np.signbit(replace(camera_at((3, -4, 2)), camera_from_world=turn).centre).any()


def test_an_undistorted_pixel_is_the_pixel_of_the_undistorted_camera():
    camera = camera_at((-4, -5, 1.5), distortion=LENS)
    points = scattered(20)
    straight = camera.undistort_px(camera.px_from_world(points))
    assert np.allclose(straight, camera.without_distortion().px_from_world(points), atol=1e3 * ROUNDTRIP)


@pytest.mark.parametrize("distortion", [None, LENS])
def test_a_rig_gives_back_the_points_that_it_sees(distortion):
    rig = three_cameras(distortion)
    points = scattered(6).reshape(3, 1, 2, 3)
    px = np.stack([camera.px_from_world(points) for camera in rig], axis=-2)
    px[0, 0, 0, 1] = np.nan
    assert np.allclose(rig.points_from_px(px), points, atol=ROUNDTRIP)


def test_a_scaled_and_cropped_image_has_the_calibration_pixels_at_their_places():
    """The first cameras of the balance trial: image = (x / 1.00741, (y + 7.11) / 1.00741) of calibration pixels."""
    camera = camera_at((-4, -5, 1.5), distortion=LENS)
    saved = camera.resample(scale=(1.00741, 1.00741), offset=(0.0, -7.11), size=(1080, 1920))
    points = scattered(20)
    x, y = camera.px_from_world(points).T
    expected = np.stack([x / 1.00741, (y + 7.11) / 1.00741], axis=-1)
    assert np.allclose(saved.px_from_world(points), expected, atol=ROUNDTRIP)
    assert saved.size == (1080, 1920)


def test_resampling_there_and_back_is_the_same_camera():
    camera = camera_at((-4, -5, 1.5))
    there = camera.resample(scale=(2.0, 3.0), offset=(5.0, -7.0), size=(384, 192))
    back = there.resample(scale=(1 / 2, 1 / 3), offset=(-5 / 2, 7 / 3), size=camera.size)
    assert np.allclose(back.K, camera.K, atol=ROUNDTRIP)


def test_a_field_keeps_its_rows_where_they_were():
    camera = camera_at((-4, -5, 1.5))
    points = scattered(5)
    for parity in (0, 1):
        u, v = camera.field(parity).px_from_world(points).T
        assert np.allclose(np.stack([u, 2 * v + parity], -1), camera.px_from_world(points), atol=ROUNDTRIP)


def test_an_unknown_camera_is_named_with_those_that_exist():
    with pytest.raises(CalibrationError, match=r"'front' not in rig; it has: left, right, side"):
        three_cameras()["front"]


@pytest.mark.parametrize("distortion", [None, LENS])
@pytest.mark.parametrize("px", [[1, 2, 3], 5.0, "a", [[1, 2], [3]]])
def test_what_are_no_pixels_is_refused_by_its_shape(distortion, px):
    camera = camera_at((-4, -5, 1.5), distortion=distortion)
    for change in (camera.distort_px, camera.undistort_px):
        with pytest.raises(CalibrationError, match=r"expected \(\.\.\., 2\), u, v"):
            change(px)


@pytest.mark.parametrize(
    ("weights", "said"), [([1, 1], r"expected \(\.\.\., 3\), one a camera"), ([1, -1, 1], "is -1;")]
)
def test_weights_are_one_a_camera_and_none_below_zero(weights, said):
    rig = three_cameras(None)
    px = np.stack([camera.px_from_world([0.0, 0.0, 1.0]) for camera in rig])
    with pytest.raises(CalibrationError, match=said):
        rig.points_from_px(px, weights=weights)
