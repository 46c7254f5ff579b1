"""The bootstrap filter: resample, propagate, reweight (Arulampalam et al. 2002, SIR)."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from airborne.tracking.particle.resampling import Resampler, effective_sample_size, normalise, systematic
from airborne.types import Array

ResampleWhen = Literal["always", "ess"]


class Particles(NamedTuple):
    """A weighted particle set."""

    values: Array  # (n, ...)
    log_weights: Array  # (n,), normalised

    @property
    def mean(self) -> Array:
        """Weighted mean of the values: (...)."""
        return np.tensordot(np.exp(self.log_weights), self.values, 1)


def uniform_particles(values: Array) -> Particles:
    """Return particles of uniform weight: values (n, ...)."""
    return Particles(values, np.full(len(values), -np.log(len(values))))


def resample(
    rng: np.random.Generator, particles: Particles, *, scheme: Resampler = systematic, when: ResampleWhen = "always"
) -> Particles:
    """Resample to n uniform weights; with `when="ess"` only if the effective sample size is below n / 2."""
    n = len(particles.log_weights)
    if when == "ess" and effective_sample_size(particles.log_weights) >= n / 2:
        return particles
    return uniform_particles(particles.values[scheme(rng, particles.log_weights, n)])


def reweight(particles: Particles, log_likelihood: Array) -> Particles:
    """Multiply the weights by likelihoods, as logs (n,)."""
    return Particles(particles.values, normalise(particles.log_weights + log_likelihood))
