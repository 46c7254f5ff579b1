"""The bootstrap filter against the exact answer of a linear system with Gaussian noise."""

import numpy as np
import pytest

from airborne.tracking.particle.bootstrap import bootstrap_step, resample, reweight, uniform_particles
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
    """Means, covariances and the log-evidence, in closed form."""
    mean, cov, log_evidence, means, covs = np.zeros(2), np.eye(2), 0.0, [], []
    for y in observations:
        mean, cov = A @ mean, A @ cov @ A.T + np.diag(Q**2)
        s = cov[0, 0] + R**2
        log_evidence += -0.5 * ((y - mean[0]) ** 2 / s + np.log(2 * np.pi * s))
        gain = cov[:, 0] / s
        mean, cov = mean + gain * (y - mean[0]), cov - np.outer(gain, cov[0])
        means.append(mean)
        covs.append(cov)
    return np.array(means), np.array(covs), log_evidence


def run(seed, scheme="systematic", when="always"):
    rng = np.random.default_rng(seed)
    particles, means, log_evidence = uniform_particles(rng.standard_normal((N, 2))), [], 0.0
    for y in observations():
        particles, weighing = bootstrap_step(
            rng,
            particles,
            propagate=lambda rng, x: x @ A.T + Q * rng.standard_normal(x.shape),
            log_likelihood=lambda x, y=y: -0.5 * ((y - x[:, 0]) / R) ** 2 - 0.5 * np.log(2 * np.pi * R**2),
            scheme=SCHEMES[scheme],
            when=when,
        )
        assert weighing.is_informative
        means.append(particles.mean)
        log_evidence += weighing.log_evidence
    return np.array(means), log_evidence


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("when", ["always", "ess"])
def test_means_and_evidence_are_those_of_the_kalman_filter(scheme, when):
    means, covs, log_evidence = kalman(observations())
    means_by_run, evidence = zip(*(run(seed, scheme, when) for seed in range(4)), strict=True)
    sd = np.sqrt(np.diagonal(covs, axis1=1, axis2=2))
    # a weighted mean of 4 N particles, of which resampling leaves at least a tenth independent
    tolerance = 3 / np.sqrt(4 * N * 0.1)
    assert (np.abs(np.mean(means_by_run, axis=0) - means) / sd).max() < tolerance
    assert np.mean(evidence) == pytest.approx(log_evidence, abs=3 * np.sqrt(STEPS / (4 * N * 0.1)))


def test_resampling_only_when_few_are_worth_something():
    rng = np.random.default_rng(0)
    fine, _ = reweight(uniform_particles(np.arange(10.0)), np.linspace(0, 0.5, 10))
    assert resample(rng, fine, when="ess") is fine
    poor, _ = reweight(uniform_particles(np.arange(10.0)), np.r_[0, np.full(9, -50.0)])
    again = resample(rng, poor, when="ess")
    assert effective_sample_size(again.log_weights) == pytest.approx(10)
    assert (again.values == 0).all()


def test_an_impossible_observation_leaves_equal_weights_and_says_so():
    particles, weighing = reweight(uniform_particles(np.arange(4.0)), np.full(4, -np.inf))
    assert not weighing.is_informative
    assert np.allclose(np.exp(particles.log_weights), 0.25, atol=EXACT)
    assert np.isfinite(particles.mean)


def test_one_step_with_likelihoods_is_bayes_rule():
    particles, weighing = reweight(uniform_particles(np.array([1.0, 2.0])), np.log([0.2, 0.6]))
    assert np.allclose(np.exp(particles.log_weights), [0.25, 0.75], atol=EXACT)
    assert weighing.log_evidence == pytest.approx(np.log(0.4))
    assert particles.mean == pytest.approx(1.75)
