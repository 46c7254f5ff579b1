"""The bootstrap filter against the exact answer of a linear system with Gaussian noise."""

import numpy as np
import pytest

from airborne.tracking.particle.bootstrap import Particles, resample, reweight, uniform_particles
from airborne.tracking.particle.resampling import SCHEMES, effective_sample_size
from tests.support.tolerances import EXACT

A, Q, R, STEPS, N = np.array([[1.0, 0.1], [0.0, 0.95]]), np.array([0.02, 0.3]), 0.4, 25, 4000


def observations():
    rng, x = np.random.default_rng(0), np.array([0.5, 2.0])
    observations = []
    for _ in range(STEPS):
        x = A @ x + Q * rng.standard_normal(2)
        observations.append(x[0] + R * rng.standard_normal())
    return np.array(observations)


def kalman(observations):
    """Means and covariances, in closed form."""
    mean, cov, means, covs = np.zeros(2), np.eye(2), [], []
    for y in observations:
        mean, cov = A @ mean, A @ cov @ A.T + np.diag(Q**2)
        s = cov[0, 0] + R**2
        gain = cov[:, 0] / s
        mean, cov = mean + gain * (y - mean[0]), cov - np.outer(gain, cov[0])
        means.append(mean)
        covs.append(cov)
    return np.array(means), np.array(covs)


def run(seed, scheme="systematic", when="always"):
    rng = np.random.default_rng(seed)
    particles, means = uniform_particles(rng.standard_normal((N, 2))), []
    for y in observations():
        particles = resample(rng, particles, scheme=SCHEMES[scheme], when=when)
        x = particles.values @ A.T + Q * rng.standard_normal((N, 2))
        particles = reweight(Particles(x, particles.log_weights), -0.5 * ((y - x[:, 0]) / R) ** 2)
        means.append(particles.mean)
    return np.array(means)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("when", ["always", "ess"])
def test_means_are_those_of_the_kalman_filter(scheme, when):
    means, covs = kalman(observations())
    means_by_run = [run(seed, scheme, when) for seed in range(4)]
    sd = np.sqrt(np.diagonal(covs, axis1=1, axis2=2))
    # a weighted mean of 4 N particles, of which resampling leaves at least a tenth independent
    tolerance = 3 / np.sqrt(4 * N * 0.1)
    assert (np.abs(np.mean(means_by_run, axis=0) - means) / sd).max() < tolerance


def test_resampling_only_when_few_are_worth_something():
    rng = np.random.default_rng(0)
    fine = reweight(uniform_particles(np.arange(10.0)), np.linspace(0, 0.5, 10))
    assert resample(rng, fine, when="ess") is fine
    poor = reweight(uniform_particles(np.arange(10.0)), np.r_[0, np.full(9, -50.0)])
    again = resample(rng, poor, when="ess")
    assert effective_sample_size(again.log_weights) == pytest.approx(10)
    assert (again.values == 0).all()


def test_an_impossible_observation_leaves_equal_weights():
    particles = reweight(uniform_particles(np.arange(4.0)), np.full(4, -np.inf))
    assert np.allclose(np.exp(particles.log_weights), 0.25, atol=EXACT)
    assert np.isfinite(particles.mean)


def test_one_step_with_likelihoods_is_bayes_rule():
    particles = reweight(uniform_particles(np.array([1.0, 2.0])), np.log([0.2, 0.6]))
    assert np.allclose(np.exp(particles.log_weights), [0.25, 0.75], atol=EXACT)
    assert particles.mean == pytest.approx(1.75)
