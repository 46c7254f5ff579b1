"""Orientations are smoothed as rotations: no flips, no turns lost, angular velocity as it is."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.geometry.rotations import geodesic
from airborne.motion.smoothing import (
    butterworth_smoother,
    continuous_quaternions,
    kalman_smoother,
    smooth_rotations,
    spline_smoother,
)
from tests.support.tolerances import EXACT

RATE = 60.0
N = 60
T = np.arange(N) / RATE
SPIN = np.array([9.0, 1.0, 3.0])  # about a fixed axis [rad/s]: a turn and a half
METHODS = {
    "butterworth": partial(butterworth_smoother, cutoff_hz=10),
    "spline": spline_smoother,
    "kalman": kalman_smoother,
}


def spinning(sd=0.0, seed=0):
    rng = np.random.default_rng(seed)
    return Rotation.from_rotvec(sd * rng.normal(size=(N, 3))) * Rotation.from_rotvec(T[:, None] * SPIN)


def test_quaternions_continue_over_revolutions_and_gaps():
    R = spinning().as_matrix()
    R[30:34] = np.nan
    q = continuous_quaternions(R)
    known = np.isfinite(q[:, 0])
    assert known.sum() == N - 4
    assert (np.einsum("ni,ni->n", q[known][1:], q[known][:-1]) > 0.8).all()
    assert np.nanmin(q) < -0.9 and np.nanmax(q) > 0.9
    assert Rotation.from_quat(q[known]).as_matrix() == pytest.approx(R[known], abs=EXACT * 10)


@pytest.mark.parametrize("name", METHODS)
def test_a_steady_spin_keeps_its_rate_and_phase(name):
    result = smooth_rotations(METHODS[name], T, spinning().as_matrix(), np.full(N, 1e-6))
    inside = slice(10, -10)
    assert geodesic(result.R, spinning().as_matrix())[inside].max() < 2e-3
    assert result.velocity[inside] == pytest.approx(np.broadcast_to(SPIN, (N - 20, 3)), abs=0.05)
    assert np.abs(result.acceleration[inside]).max() < 2.0


@pytest.mark.parametrize("name", METHODS)
def test_noise_is_taken_off_and_the_rest_is_stated(name):
    sd = 0.03
    result = smooth_rotations(METHODS[name], T, spinning(sd).as_matrix(), np.full(N, sd**2))
    error = (Rotation.from_matrix(result.R) * spinning().inv()).as_rotvec()
    assert np.std(error) < 0.8 * sd
    assert 0.4 < np.std(error) / np.median(result.sd) < 1.5


def test_velocity_is_the_derivative_of_the_smooth_orientation():
    result = smooth_rotations(METHODS["kalman"], T, spinning(0.02).as_matrix(), np.full(N, 4e-4))
    step = (Rotation.from_matrix(result.R[2:]) * Rotation.from_matrix(result.R[:-2]).inv()).as_rotvec()
    assert result.velocity[1:-1] == pytest.approx(step * RATE / 2, abs=0.1)
    change = (result.velocity[2:] - result.velocity[:-2]) * RATE / 2
    assert np.abs(result.acceleration[1:-1] - change).max() < 0.1 * np.abs(change).max() + 1.0


def test_lost_frames_stay_lost():
    R = spinning().as_matrix()
    R[40:44] = np.nan
    result = smooth_rotations(METHODS["spline"], T, R, np.full(N, 1e-6))
    assert np.isnan(result.R[40:44]).all()
    filled = smooth_rotations(METHODS["spline"], T, R, np.full(N, 1e-6), fill_s=0.1)
    assert geodesic(filled.R[40:44], spinning().as_matrix()[40:44]).max() < 0.02
    assert np.flatnonzero(filled.is_filled).tolist() == [40, 41, 42, 43]
