"""The block-jump paper's baseline: one Gaussian filter over all 18 coordinates, weighed by colour alone (Table I)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.particle.bootstrap import Particles, equal, resampled, weighed
from airborne.tracking.particle.observations import Look
from airborne.tracking.particle.parts import N_PARTS, ends_of
from airborne.tracking.particle.resampling import SCHEMES
from airborne.tracking.particle.settings import LegsSettings
from airborne.tracking.particle.situation import Found, Situation, chosen, spread, walk

Array = NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Framework:
    """Particles (n, 6, 3) that walk at random (equations 1 to 6, without the distances)."""

    settings: LegsSettings

    def begin(self, points: Array) -> Particles:
        """Return n particles at points (6, 3)."""
        return equal(np.repeat(points[None], self.settings.n_particles, axis=0))

    def move(self, rng: np.random.Generator, belief: Particles, now: Situation) -> Particles:
        """Resample and take a Gaussian step."""
        scheme, when = SCHEMES[self.settings.resample], self.settings.resample_when
        belief = resampled(rng, belief, resample=scheme, when=when)
        most_m = np.repeat([now.most_m(joint) for joint in ("hips", "knees", "ankles")], 2)
        return Particles(walk(rng, belief.values, most_m, now.shift), belief.log_weights)

    def cloud(self, belief: Particles) -> Array:
        """Return all points (n, 3)."""
        return belief.values.reshape(-1, 3)

    def weigh(self, belief: Particles, look: Look, now: Situation) -> tuple[Particles, Found]:
        """Weigh by the colours of all parts."""
        log_likelihood = look.log_likelihood(ends_of(belief.values), range(N_PARTS)).sum(axis=-1)
        belief, _ = weighed(belief, log_likelihood)
        points = chosen(belief, self.settings.estimate)
        return belief, Found(points, spread(belief.values, np.exp(belief.log_weights), points))
