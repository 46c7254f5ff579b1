import cv2
import numpy as np

from airborne.cameras.dlt import decompose, decompose_with_skew, dlt_coefficients, fit_dlt
from tests.support.cameras import camera_at, scattered
from tests.support.tolerances import ROUNDTRIP

CAMERA = camera_at((-4, -5, 1.5))
WORLD = scattered(12)
PX = CAMERA.px_from_world(WORLD)


def compose(K, R, centre):
    return K @ R @ np.column_stack([np.eye(3), -centre])


def test_exact_points_give_the_camera_back():
    P = fit_dlt(WORLD, PX)
    assert np.allclose(P / 1000, CAMERA.P / 1000, atol=ROUNDTRIP)
    found = decompose(P)
    assert np.allclose(found.K / 1000, CAMERA.K / 1000, atol=ROUNDTRIP)
    assert np.allclose(found.R, CAMERA.camera_from_world.rotation.as_matrix(), atol=ROUNDTRIP)
    assert np.allclose(found.centre, CAMERA.centre, atol=ROUNDTRIP)
    assert not found.is_mirrored


def test_compose_takes_back_decompose():
    P = CAMERA.P
    found = decompose(P)
    assert np.allclose(compose(found.K, found.R, found.centre), P, rtol=ROUNDTRIP)


def test_the_decomposition_is_that_of_opencv():
    K, R, homogeneous = cv2.decomposeProjectionMatrix(CAMERA.P)[:3]
    found = decompose(CAMERA.P)
    assert np.allclose(found.K, K / K[2, 2], rtol=ROUNDTRIP, atol=1e3 * ROUNDTRIP)
    assert np.allclose(found.R, R, atol=ROUNDTRIP)
    assert np.allclose(found.centre, (homogeneous[:3] / homogeneous[3]).ravel(), atol=ROUNDTRIP)


def test_the_coefficients_solve_the_eleven_parameter_equations():
    x, y, z = WORLD.T
    zero, one = np.zeros(len(WORLD)), np.ones(len(WORLD))
    u, v = PX.T
    rows = np.vstack(
        [
            np.column_stack([x, y, z, one, zero, zero, zero, zero, -u * x, -u * y, -u * z]),
            np.column_stack([zero, zero, zero, zero, x, y, z, one, -v * x, -v * y, -v * z]),
        ]
    )
    oracle = np.linalg.lstsq(rows, np.concatenate([u, v]))[0]
    assert np.allclose(dlt_coefficients(fit_dlt(WORLD, PX)), oracle, rtol=1e3 * ROUNDTRIP)


def test_a_far_origin_does_not_harm_the_fit():
    shift = np.array([4000.0, -7000.0, 300.0])
    found = decompose(fit_dlt(WORLD + shift, PX))
    assert np.allclose(found.centre - shift, CAMERA.centre, atol=1e3 * ROUNDTRIP)


def test_a_camera_beside_the_origin_still_has_a_matrix():
    camera = camera_at((0, 0, 0), target=(0.0, 5.0, 0.0))
    world = np.add(scattered(12), [0, 5, -1])
    assert np.allclose(decompose(fit_dlt(world, camera.px_from_world(world))).centre, 0, atol=1e2 * ROUNDTRIP)


def test_a_mirrored_world_or_image_is_seen_as_such():
    for world, px in ((WORLD * [-1, 1, 1], PX), (WORLD[:, [1, 0, 2]], PX), (WORLD, PX[:, ::-1])):
        assert decompose(fit_dlt(world, px)).is_mirrored
    assert not decompose(fit_dlt(WORLD[:, [1, 2, 0]], PX)).is_mirrored


def test_all_eleven_numbers_come_back_with_skew_from_either_sign_as_in_opencv():
    K = CAMERA.K + np.array([[0, 7, 0], [0, 30, 0], [0, 0, 0]])
    P = compose(K, CAMERA.camera_from_world.rotation.as_matrix(), CAMERA.centre)
    oracle = cv2.decomposeProjectionMatrix(P)[0]
    for scaled in (P, -P, 1e-3 * P):
        found = decompose_with_skew(scaled)
        assert np.allclose(compose(found.K, found.R, found.centre), P, rtol=ROUNDTRIP)
        assert np.allclose(found.K, oracle / oracle[2, 2], rtol=ROUNDTRIP, atol=1e3 * ROUNDTRIP)
        assert not found.is_mirrored
