"""The bootstrap filter: resample, propagate, reweight (Arulampalam et al. 2002, SIR)."""

from __future__ import annotations

from collections.abc import Callable
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


class WeightUpdate(NamedTuple):
    """What a weight update yields besides the weights."""

    log_evidence: float  # log p(observation | past observations) [nat]; -inf if no particle explains it
    is_informative: bool  # False: all weights were zero and have been reset to uniform


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


def reweight(particles: Particles, log_likelihood: Array) -> tuple[Particles, WeightUpdate]:
    """Multiply the weights by likelihoods, as logs (n,)."""
    log_weights, log_sum, says_something = normalise(particles.log_weights + log_likelihood)
    return Particles(particles.values, log_weights), WeightUpdate(log_sum, says_something)


def bootstrap_step(
    rng: np.random.Generator,
    particles: Particles,
    *,
    propagate: Callable[[np.random.Generator, Array], Array],
    log_likelihood: Callable[[Array], Array],
    scheme: Resampler = systematic,
    when: ResampleWhen = "always",
) -> tuple[Particles, WeightUpdate]:
    """Advance one time step: resample by the last weights, propagate every particle, reweight by the new observation.

    `propagate` maps values (n, ...) to values; `log_likelihood` maps them to (n,) [nat].
    """
    resampled = resample(rng, particles, scheme=scheme, when=when)
    values = propagate(rng, resampled.values)
    return reweight(Particles(values, resampled.log_weights), log_likelihood(values))
