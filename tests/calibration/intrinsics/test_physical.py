import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.calibration.intrinsics.physical import (
    PINHOLE_MODELS,
    SEVEN_PARAMETERS,
    Pinhole,
    anneal_pinhole,
    fit_pinhole,
    parameter_covariance,
    parameter_names,
)
from tests.support.cameras import camera_at, scattered
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED, sampled

CAMERA = camera_at((-4, -5, 1.5), distortion=np.array([-0.1, 0, 0, 0, 0]))
K1 = np.array([-0.1, 0, 0, 0, 0])
TRUTH = Pinhole(CAMERA.camera_from_world.rotation.as_matrix(), CAMERA.centre, 1000.0, CAMERA.K[:2, 2], K1)
STRAIGHT = Pinhole(TRUTH.R, TRUTH.centre, 1000.0, TRUTH.principal_point)
WORLD = scattered(20)


def far_from(pinhole):
    R = Rotation.from_rotvec([0.03, -0.05, 0.02]).as_matrix() @ pinhole.R
    return Pinhole(R, np.add(pinhole.centre, [0.2, -0.3, 0.1]), 1080.0, pinhole.principal_point)


def distance(a, b):
    return max(np.abs(a.R - b.R).max(), np.abs(a.centre - b.centre).max(), abs(a.focal_px / b.focal_px - 1))


def test_a_pinhole_projects_as_the_camera_it_becomes():
    assert np.allclose(TRUTH.px_from_world(WORLD), CAMERA.px_from_world(WORLD), atol=1e3 * EXACT)
    assert np.allclose(TRUTH.P, CAMERA.P, atol=1e4 * EXACT)
    assert np.allclose(TRUTH.undistort_px(TRUTH.px_from_world(WORLD)), STRAIGHT.px_from_world(WORLD))


def test_exact_points_give_the_camera_back_from_afar():
    found = fit_pinhole(far_from(STRAIGHT), SEVEN_PARAMETERS, WORLD, STRAIGHT.px_from_world(WORLD))
    assert distance(found, STRAIGHT) < ROUNDTRIP


def test_the_full_model_finds_principal_point_and_distortion():
    truth = Pinhole(TRUTH.R, TRUTH.centre, 1000.0, np.add(TRUTH.principal_point, [15, -10]), K1)
    found = fit_pinhole(far_from(TRUTH), PINHOLE_MODELS[-1], WORLD, truth.px_from_world(WORLD))
    assert distance(found, truth) < SOLVED
    assert np.allclose(found.principal_point, truth.principal_point, atol=SOLVED)
    assert found.terms[0] == pytest.approx(-0.1, abs=SOLVED)


@pytest.mark.parametrize("model", PINHOLE_MODELS)
def test_every_free_number_has_a_name_and_moves_the_image(model):
    names = parameter_names(model)
    assert len(names) == model.n_parameters
    for i in range(len(names)):
        step = np.zeros(len(names))
        step[i] = 1e-3
        assert np.any(TRUTH.apply_step(model, step).px_from_world(WORLD) != TRUTH.px_from_world(WORLD)), names[i]


def test_the_standard_deviations_are_those_of_many_fits():
    rng = np.random.default_rng(0)
    n = 150
    clicks = [STRAIGHT.px_from_world(WORLD) + rng.normal(0, 0.5, (len(WORLD), 2)) for _ in range(n)]
    fits = [fit_pinhole(STRAIGHT, SEVEN_PARAMETERS, WORLD, px) for px in clicks]
    spread = np.std([[*fit.centre, fit.focal_px] for fit in fits], axis=0)
    covariances = [parameter_covariance(f, SEVEN_PARAMETERS, WORLD, px) for f, px in zip(fits, clicks, strict=True)]
    stated = np.mean([np.sqrt(np.diag(covariance)) for covariance in covariances], axis=0)
    assert np.allclose(spread, stated[3:], rtol=sampled(n))


def test_annealing_finds_what_least_squares_finds():
    px = STRAIGHT.px_from_world(WORLD) + np.random.default_rng(0).normal(0, 0.5, (len(WORLD), 2))
    annealed = anneal_pinhole(far_from(STRAIGHT), WORLD, px, seed=0)
    assert distance(annealed, fit_pinhole(far_from(STRAIGHT), SEVEN_PARAMETERS, WORLD, px)) < SOLVED


def test_annealing_stays_inside_its_bounds():
    start = Pinhole(STRAIGHT.R, np.add(STRAIGHT.centre, [0.8, 0, 0]), 1000.0, STRAIGHT.principal_point)
    found = anneal_pinhole(start, WORLD, STRAIGHT.px_from_world(WORLD), seed=0)
    assert np.all(np.abs(found.centre - start.centre) <= 0.5 + EXACT)
    assert abs(found.focal_px / 1000 - 1) <= 0.2 + EXACT
