import numpy as np

from airborne.sync.lags import find_lags
from airborne.tracking.camera_lags import LagEquations, solve_lags
from tests.support.tolerances import EXACT, SOLVED

N, C = 40, 3
RNG = np.random.default_rng(0)
TIMES = np.arange(N) * 0.02 - 0.1
VELOCITY = np.stack([np.sin(3 * TIMES + k) * (3 if k < 3 else 8) for k in range(6)], axis=1)
_HALVES = RNG.normal(size=(N, C, 4, 6)) * 100
CURVATURE = np.einsum("kcai,kcaj->kcij", _HALVES, _HALVES)


def equations(lag_s, drift=(0, 0, 0), noise=0.0, seed=0) -> LagEquations:
    """What cameras of given lags see of a body whose poses were found slightly wrong."""
    rng = np.random.default_rng(seed)
    wrong = rng.normal(0, 1e-3, (N, 1, 6))
    late = np.asarray(lag_s) + np.outer(TIMES, drift)
    moved = VELOCITY[:, None] * late[..., None] + wrong
    slope = np.einsum("kcij,kcj->kci", CURVATURE, moved)
    slope += noise * np.einsum("kcai,kca->kci", _HALVES, rng.normal(size=(N, C, 4)))
    return LagEquations(TIMES, VELOCITY, CURVATURE.copy(), slope)


def test_lags_come_out_of_exact_sightings_exactly_whatever_the_poses_errors():
    step, sd = solve_lags(equations((0, 0.004, -0.011)))
    assert np.allclose(step[:C], (0, 0.004, -0.011), atol=1e-9)
    assert np.allclose(sd, 0, atol=1e-9)
    assert np.allclose(step[C:], 0, atol=EXACT)


def test_a_lag_of_all_cameras_together_is_none():
    step, _ = solve_lags(equations((0.01, 0.01, 0.01)))
    assert np.allclose(step, 0, atol=1e-9)


def test_drift_and_lag_are_separated():
    step, _ = solve_lags(equations((0, 0.004, -0.002), drift=(0, 0.003, -0.001)), with_drift=True)
    assert np.allclose(step, (0, 0.004, -0.002, 0, 0.003, -0.001), atol=1e-8)


def test_errors_lie_within_the_stated_sds():
    misses = []
    for seed in range(60):
        step, sd = solve_lags(equations((0, 0.004, -0.002), noise=1.0, seed=seed))
        misses += list((step - (0, 0.004, -0.002, 0, 0, 0))[1:C] / sd[1:C])
    assert 0.85 < np.sqrt(np.mean(np.square(misses))) < 1.25


def test_a_camera_that_saw_nothing_has_no_lag():
    system = equations((0, 0.004, -0.002))
    system.information[:, 2] = system.gradient[:, 2] = 0
    step, sd = solve_lags(system)
    assert np.isnan([step[2], sd[2]]).all()
    assert abs(step[1] - 0.004) < 1e-9


def test_without_the_first_camera_the_next_one_is_the_clock():
    system = equations((0, 0.004, -0.002))
    system.information[:, 0] = system.gradient[:, 0] = 0
    step, sd = solve_lags(system)
    assert np.isnan([step[0], sd[0]]).all()
    assert step[1] == sd[1] == 0
    assert abs(step[2] + 0.006) < 1e-9


def test_a_camera_that_never_sees_the_body_keeps_no_other_from_its_lag():
    truth = np.array([0, 0.007, -0.003])

    def measure(lag_s, drift):
        system = equations(truth - lag_s)
        system.information[:, 2] = system.gradient[:, 2] = 0
        return system

    found = find_lags(measure, np.zeros(C))
    assert np.allclose(found.lag_s[:2], truth[:2], atol=SOLVED)
    assert np.isnan([found.lag_s[2], found.sd_s[2]]).all()


def test_steps_that_are_too_short_still_lead_there_and_widen_the_sds():
    truth, measurements = np.array([0, 0.007, -0.003]), []

    def measure(lag_s, drift):
        measurements.append(lag_s)
        return equations(0.4 * (truth - lag_s), noise=0.02, seed=len(measurements))

    found = find_lags(measure, np.zeros(C))
    assert np.allclose(found.lag_s, truth, atol=SOLVED)
    assert len(measurements) <= 6
    _, sd = solve_lags(measure(truth, np.zeros(C)))
    assert np.all(found.sd_s[1:] > 1.5 * sd[1:C])
