from dataclasses import replace

import numpy as np

from airborne.calibration.intrinsics.model_selection import candidates_for, choose_simplest, leave_one_out
from airborne.calibration.intrinsics.physical import PINHOLE_MODELS, SEVEN_PARAMETERS, fit_pinhole
from tests.calibration.intrinsics.test_physical import STRAIGHT, TRUTH, WORLD
from tests.support.tolerances import ROUNDTRIP, SOLVED


def solutions_of(truth, sd_px=0.5, seed=0):
    px = truth.px_from_world(WORLD) + np.random.default_rng(seed).normal(0, sd_px, (len(WORLD), 2))
    return [leave_one_out(fit_pinhole(STRAIGHT, m, WORLD, px), m, WORLD, px) for m in PINHOLE_MODELS]


def test_a_held_out_point_has_no_say():
    px = STRAIGHT.px_from_world(WORLD)
    px[3] += [40, -30]
    solution = leave_one_out(fit_pinhole(STRAIGHT, SEVEN_PARAMETERS, WORLD, px), SEVEN_PARAMETERS, WORLD, px)
    assert np.allclose(solution.held_out_px[3], [40, -30], atol=1e3 * ROUNDTRIP)
    assert np.linalg.norm(solution.residual_px[3]) < 45


def test_refits_taken_together_are_the_fits_of_each_alone():
    for solution in solutions_of(TRUTH):
        for k in (0, 5, len(WORLD) - 1):
            alone = fit_pinhole(
                solution.pinhole, solution.model, np.delete(WORLD, k, axis=0), np.delete(solution.px, k, axis=0)
            )
            difference = solution.refits[k].px_from_world(WORLD) - alone.px_from_world(WORLD)
            np.testing.assert_allclose(difference, 0, atol=SOLVED)


def test_held_out_errors_exceed_residuals():
    for solution in solutions_of(STRAIGHT):
        assert np.sum(solution.held_out_px**2) > np.sum(solution.residual_px**2)


def test_a_plain_camera_gets_the_plain_model():
    assert choose_simplest(solutions_of(STRAIGHT)).model == SEVEN_PARAMETERS


def test_a_bending_lens_gets_its_distortion_term():
    assert choose_simplest(solutions_of(TRUTH)).model.terms == (0,)


def test_an_axis_off_the_middle_gets_its_principal_point():
    off = replace(STRAIGHT, principal_point=np.add(STRAIGHT.principal_point, [60, -40]))
    assert choose_simplest(solutions_of(off)).model.frees_principal_point


def test_few_points_support_few_numbers():
    px = TRUTH.px_from_world(WORLD)
    for n, most in ((6, 9), (7, 10), (len(WORLD), 13)):
        assert max(s.model.n_parameters for s in candidates_for(STRAIGHT, WORLD[:n], px[:n])) == most
