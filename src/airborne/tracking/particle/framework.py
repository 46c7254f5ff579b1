"""The block-jump paper's baseline: one Gaussian filter over all 18 coordinates, weighted by colour alone (Table I)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airborne.tracking.particle.bootstrap import Particles, resample, reweight, uniform_particles
from airborne.tracking.particle.observations import LegsObservation
from airborne.tracking.particle.parts import N_PARTS, ends_of
from airborne.tracking.particle.resampling import SCHEMES
from airborne.tracking.particle.settings import LegsSettings
from airborne.tracking.particle.situation import LegsEstimate, Situation, point_estimate, random_walk, second_moments
from airborne.types import Array


@dataclass(frozen=True, slots=True)
class Framework:
    """Particles (n, 6, 3) that walk at random (equations 1 to 6, without the distances)."""

    settings: LegsSettings

    def init(self, points: Array) -> Particles:
        """Return n particles at points (6, 3)."""
        return uniform_particles(np.repeat(points[None], self.settings.n_particles, axis=0))

    def predict(self, rng: np.random.Generator, particles: Particles, now: Situation) -> Particles:
        """Resample and take a Gaussian step."""
        scheme, when = SCHEMES[self.settings.resample], self.settings.resample_when
        particles = resample(rng, particles, scheme=scheme, when=when)
        max_step_m = np.repeat([now.max_step_m(joint) for joint in ("hips", "knees", "ankles")], 2)
        return Particles(random_walk(rng, particles.values, max_step_m, now.shift), particles.log_weights)

    def all_points(self, particles: Particles) -> Array:
        """Return all points (n, 3)."""
        return particles.values.reshape(-1, 3)

    def update(
        self, particles: Particles, observation: LegsObservation, now: Situation
    ) -> tuple[Particles, LegsEstimate]:
        """Reweight by the colours of all parts."""
        log_likelihood = observation.log_likelihood(ends_of(particles.values), range(N_PARTS)).sum(axis=-1)
        particles = reweight(particles, log_likelihood)
        points = point_estimate(particles, self.settings.estimate)
        return particles, LegsEstimate(points, second_moments(particles.values, np.exp(particles.log_weights), points))
