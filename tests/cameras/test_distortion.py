import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airborne.cameras.distortion import distort, distort_fisheye, undistort, undistort_fisheye
from tests.support.cameras import LENS
from tests.support.tolerances import ROUNDTRIP

XY = np.random.default_rng(0).uniform(-0.6, 0.6, (50, 2))


def test_distortion_is_that_of_opencv():
    points = np.column_stack([XY, np.ones(len(XY))])
    oracle, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), LENS)
    assert np.allclose(distort(XY, LENS), oracle[:, 0], atol=ROUNDTRIP)


@pytest.mark.parametrize("n_terms", [1, 4, 5, 8])
def test_the_rational_model_is_that_of_opencv_and_turns_back(n_terms):
    lens = np.array([0.31, -0.04, 0.001, -0.0007, 0.012, 0.62, 0.03, 0.004])[:n_terms]
    points = np.column_stack([XY, np.ones(len(XY))])
    oracle, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), np.pad(lens, (0, 8 - n_terms)))
    assert np.allclose(distort(XY, lens), oracle[:, 0], atol=ROUNDTRIP)
    assert np.allclose(undistort(distort(XY, lens), lens), XY, atol=ROUNDTRIP)


@given(
    st.tuples(
        *(st.floats(-size, size) for size in (0.3, 0.1, 0.01, 0.01, 0.05)),
    ),
    st.sampled_from([(), (1,), (3, 1, 2)]),
)
@settings(max_examples=50, deadline=None, derandomize=True)
def test_undistort_takes_back_distort(lens, batch):
    xy = np.random.default_rng(1).uniform(-0.5, 0.5, (*batch, 2))
    assert np.allclose(undistort(distort(xy, np.array(lens)), np.array(lens)), xy, atol=ROUNDTRIP)


def test_four_terms_mean_that_the_fifth_is_zero():
    assert np.array_equal(distort(XY, LENS[:4]), distort(XY, np.append(LENS[:4], 0)))


def test_where_the_lens_folds_back_there_is_no_inverse():
    lens = np.array([-0.3, 0, 0, 0, 0])  # no point comes out farther than 0.703 from the axis
    assert np.isnan(undistort(np.array([0.75, 0.0]), lens)).all()
    assert np.isfinite(undistort(np.array([0.65, 0.0]), lens)).all()


def test_a_missing_point_stays_missing():
    assert np.isnan(undistort(np.array([np.nan, np.nan]), LENS)).all()


FISHEYE = np.array([0.03, -0.01, 0.004, -0.001])


def test_a_fisheye_lens_is_that_of_opencv():
    rays = np.column_stack([3 * XY, np.ones(len(XY))])
    oracle, _ = cv2.fisheye.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), np.eye(3), FISHEYE)
    assert np.allclose(distort_fisheye(3 * XY, FISHEYE), oracle[:, 0], atol=ROUNDTRIP)


@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2)])
def test_straightening_a_fisheye_takes_back_its_bending(batch):
    xy = np.random.default_rng(1).uniform(-3, 3, (*batch, 2))
    assert np.allclose(undistort_fisheye(distort_fisheye(xy, FISHEYE), FISHEYE), xy, atol=ROUNDTRIP)
    assert np.allclose(undistort_fisheye(np.zeros(2), FISHEYE), 0)


def test_what_a_fisheye_sees_beside_and_behind_itself_has_no_place_in_a_pinhole_image():
    assert np.isnan(undistort_fisheye(np.array([1.6, 0.0]), np.zeros(4))).all()
