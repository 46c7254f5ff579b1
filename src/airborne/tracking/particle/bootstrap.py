"""The bootstrap filter: resample, move, weigh (Arulampalam et al. 2002, SIR)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.particle.resampling import Resample, effective_sample_size, normalised, systematic

Array = NDArray[np.floating]
When = Literal["always", "ess"]


class Particles(NamedTuple):
    """Hypotheses and how likely each is."""

    values: Array  # (n, ...)
    log_weights: Array  # (n,), normalised

    @property
    def mean(self) -> Array:
        """The weighted mean of the values: (...)."""
        return np.tensordot(np.exp(self.log_weights), self.values, 1)


class Weighing(NamedTuple):
    """What weighing told besides the weights."""

    log_evidence: float  # log p(observation | all before) [nat]; -inf where no particle could explain it
    says_something: bool  # False: every weight was zero, and they were made equal


def equal(values: Array) -> Particles:
    """Return particles of equal weight: values (n, ...)."""
    return Particles(values, np.full(len(values), -np.log(len(values))))


def resampled(
    rng: np.random.Generator, particles: Particles, *, resample: Resample = systematic, when: When = "always"
) -> Particles:
    """Return as many particles of equal weight; with `when="ess"` only if fewer than half would be worth as much."""
    n = len(particles.log_weights)
    if when == "ess" and effective_sample_size(particles.log_weights) >= n / 2:
        return particles
    return equal(particles.values[resample(rng, particles.log_weights, n)])


def weighed(particles: Particles, log_likelihood: Array) -> tuple[Particles, Weighing]:
    """Multiply the weights by likelihoods, given as logs (n,)."""
    log_weights, log_sum, says_something = normalised(particles.log_weights + log_likelihood)
    return Particles(particles.values, log_weights), Weighing(log_sum, says_something)


def step(
    rng: np.random.Generator,
    particles: Particles,
    *,
    move: Callable[[np.random.Generator, Array], Array],
    log_likelihood: Callable[[Array], Array],
    resample: Resample = systematic,
    when: When = "always",
) -> tuple[Particles, Weighing]:
    """Go on by one time: resample by the last weights, move every particle, weigh with the new observation.

    `move` maps values (n, ...) to values; `log_likelihood` maps them to (n,) [nat].
    """
    before = resampled(rng, particles, resample=resample, when=when)
    values = move(rng, before.values)
    return weighed(Particles(values, before.log_weights), log_likelihood(values))
