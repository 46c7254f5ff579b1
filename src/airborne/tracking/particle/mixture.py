"""The mixture of particle filters: hips (PF1), each shank (PF2), and the best of their combinations.

Block-jump paper, section 3. The shanks of both sides are filtered separately, which the paper's terms allow up to the
distances between them; these are evaluated for every combination. The transition and the distance terms are a
`LegsModel`: `RandomWalk` here, or `BlockJump`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from airborne.tracking.particle.bootstrap import Particles, resample, reweight, uniform_particles
from airborne.tracking.particle.distances import TORSO_LENGTH_SD_M, length_term
from airborne.tracking.particle.observations import LegsObservation
from airborne.tracking.particle.parts import PELVIS, hip_ends, leg_ends, leg_parts
from airborne.tracking.particle.resampling import SCHEMES
from airborne.tracking.particle.settings import EstimateAs, LegsSettings
from airborne.tracking.particle.situation import N_TOP, LegsEstimate, Situation, random_walk, second_moments
from airborne.types import Array

N_BEST_HIPS, N_BEST_LEGS = 20, 30  # candidates for the combinations


class MixtureParticles(NamedTuple):
    """Particles of the three filters; a leg is its knee and ankle."""

    hips: Particles  # (n, 2, 3)
    legs: tuple[Particles, Particles]  # (n, 2, 3) left, right


class LegsModel(Protocol):
    """A transition density to sample from, and distance terms; all log-likelihoods in nats."""

    def predict_hips(self, rng: np.random.Generator, hips: Array, now: Situation) -> Array:
        """Predict hips (n, 2, 3)."""
        ...

    def predict_leg(self, rng: np.random.Generator, leg: Array, side: int, now: Situation) -> Array:
        """Predict knees and ankles (n, 2, 3) of one side."""
        ...

    def hips_terms(self, hips: Array, now: Situation) -> Array:
        """Score the distances of hips alone: (n,)."""
        ...

    def leg_terms(self, leg: Array, side: int, now: Situation) -> Array:
        """Score the distances within one leg: (n,)."""
        ...

    def thigh_terms(self, hip: Array, knee: Array, now: Situation) -> Array:
        """Score hips (..., 3) with knees (..., 3) of the same side: (...); for PF2 and again in the combinations."""
        ...

    def pair_terms(self, left: Array, right: Array, now: Situation) -> Array:
        """Score left legs (..., 2, 3) with right ones: (...)."""
        ...


@dataclass(frozen=True, slots=True)
class RandomWalk:
    """Gaussian random walks; of the distances only the rods' fixed lengths count (section 2.1)."""

    def predict_hips(self, rng: np.random.Generator, hips: Array, now: Situation) -> Array:
        """Take a Gaussian step about the torso's motion, on which equation 8 conditions the hips."""
        return random_walk(rng, hips, np.full(2, now.max_step_m("hips")), now.torso - now.torso_before)

    def predict_leg(self, rng: np.random.Generator, leg: Array, side: int, now: Situation) -> Array:
        """Take a Gaussian step."""
        return random_walk(rng, leg, np.array([now.max_step_m("knees"), now.max_step_m("ankles")]), now.shift)

    def hips_terms(self, hips: Array, now: Situation) -> Array:
        """Score L_B2H and L_H (section 3)."""
        return hips_length_terms(hips, now)

    def leg_terms(self, leg: Array, side: int, now: Situation) -> Array:
        """Score L_S."""
        return length_term(_norm(leg[:, 0] - leg[:, 1]), now.legs.shank_m)

    def thigh_terms(self, hip: Array, knee: Array, now: Situation) -> Array:
        """Score L_T."""
        return length_term(_norm(hip - knee), now.legs.thigh_m)

    def pair_terms(self, left: Array, right: Array, now: Situation) -> Array:
        """Ignore the distances between the legs."""
        return np.zeros(np.broadcast_shapes(left.shape, right.shape)[:-2])


@dataclass(frozen=True, slots=True)
class Mixture:
    """The filters and their combination, for any model of the legs."""

    settings: LegsSettings
    model: LegsModel

    def init(self, points: Array) -> MixtureParticles:
        """Return particle sets concentrated at points (6, 3)."""
        hips = uniform_particles(np.repeat(points[None, 0:2], self.settings.n_hips, axis=0))
        left, right = (
            uniform_particles(np.repeat(points[None, at], self.settings.n_leg, axis=0)) for at in ([2, 4], [3, 5])
        )
        return MixtureParticles(hips, (left, right))

    def predict(self, rng: np.random.Generator, particles: MixtureParticles, now: Situation) -> MixtureParticles:
        """Resample and predict each filter separately."""
        scheme, when = SCHEMES[self.settings.resample], self.settings.resample_when
        hips, left, right = (resample(rng, p, scheme=scheme, when=when) for p in (particles.hips, *particles.legs))
        new_hips = self.model.predict_hips(rng, hips.values, now)
        new_left, new_right = (self.model.predict_leg(rng, p.values, s, now) for s, p in enumerate((left, right)))
        return MixtureParticles(
            Particles(new_hips, hips.log_weights),
            (Particles(new_left, left.log_weights), Particles(new_right, right.log_weights)),
        )

    def all_points(self, particles: MixtureParticles) -> Array:
        """Return all points (n, 3)."""
        return np.concatenate([each.values.reshape(-1, 3) for each in (particles.hips, *particles.legs)])

    def update(
        self, particles: MixtureParticles, observation: LegsObservation, now: Situation
    ) -> tuple[MixtureParticles, LegsEstimate]:
        """Reweight the hips, then each leg given the best hip, then every combination of the best of them."""
        hips_log_likelihood = observation.log_likelihood(hip_ends(particles.hips.values), PELVIS).sum(axis=-1)
        hips = reweight(particles.hips, hips_log_likelihood + self.model.hips_terms(particles.hips.values, now))
        best = hips.values[np.argmax(hips.log_weights)]
        left, right = (
            self._update_leg(leg, s, hip=best[s], observation=observation, now=now)
            for s, leg in enumerate(particles.legs)
        )
        return MixtureParticles(hips, (left, right)), self._combine(hips, left, right, best=best, now=now)

    def _update_leg(
        self, leg: Particles, side: int, *, hip: Array, observation: LegsObservation, now: Situation
    ) -> Particles:
        values = leg.values
        leg_log_likelihood = observation.log_likelihood(leg_ends(values), leg_parts(side)).sum(axis=-1)
        thighs = self.model.thigh_terms(hip, values[:, 0], now)
        return reweight(leg, leg_log_likelihood + self.model.leg_terms(values, side, now) + thighs)

    def _combine(
        self, hips: Particles, left: Particles, right: Particles, *, best: Array, now: Situation
    ) -> LegsEstimate:
        hips, left, right = _top(hips, N_BEST_HIPS), _top(left, N_BEST_LEGS), _top(right, N_BEST_LEGS)
        log_weights = (
            hips.log_weights[:, None, None]
            + self._leg_log_weights(hips, left, 0, best=best, now=now)[:, :, None]
            + self._leg_log_weights(hips, right, 1, best=best, now=now)[:, None, :]
            + self.model.pair_terms(left.values[:, None], right.values[None, :], now)
        )
        return estimate_combination(hips.values, left.values, right.values, log_weights, rule=self.settings.estimate)

    def _leg_log_weights(self, hips: Particles, leg: Particles, side: int, *, best: Array, now: Situation) -> Array:
        """Return the legs' log-weights with every hip instead of the best one: (hips, legs)."""
        knees = leg.values[:, 0]
        with_every_hip = self.model.thigh_terms(hips.values[:, None, side], knees[None], now)
        return leg.log_weights - self.model.thigh_terms(best[side], knees, now) + with_every_hip


def estimate_combination(
    hips: Array, left: Array, right: Array, log_weights: Array, *, rule: EstimateAs
) -> LegsEstimate:
    """Estimate from combinations of hips, left and right legs, each (k, 2, 3), by their log-weights (kh, kl, kr).

    The covariance is that of the points over all combinations, about the estimate.
    """
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    shares = weights.sum(axis=(1, 2)), weights.sum(axis=(0, 2)), weights.sum(axis=(0, 1))
    if rule == "mean":
        h, lt, rt = (np.tensordot(share, part, 1) for share, part in zip(shares, (hips, left, right), strict=True))
    else:
        n = 1 if rule == "max" else N_TOP
        top = np.array([np.argmax(weights)]) if n == 1 else np.argsort(-weights, axis=None, kind="stable")[:n]
        top_weights = weights.ravel()[top] / weights.ravel()[top].sum()
        at = np.unravel_index(top, weights.shape)
        h, lt, rt = (np.tensordot(top_weights, part[i], 1) for part, i in zip((hips, left, right), at, strict=True))
    moments = [
        second_moments(part, share, about)
        for part, share, about in zip((hips, left, right), shares, (h, lt, rt), strict=True)
    ]
    points = np.array([h[0], h[1], lt[0], rt[0], lt[1], rt[1]])
    return LegsEstimate(points, np.array([*moments[0], moments[1][0], moments[2][0], moments[1][1], moments[2][1]]))


def hips_length_terms(hips: Array, now: Situation) -> Array:
    """Score L_B2H and L_H of hips (n, 2, 3): (n,) [nat]."""
    to_torso = length_term(_norm(hips.mean(axis=1) - now.torso), now.legs.torso_to_hips_m, TORSO_LENGTH_SD_M)
    return to_torso + length_term(_norm(hips[:, 0] - hips[:, 1]) / 2, now.legs.half_pelvis_m)


def _top(particles: Particles, n: int) -> Particles:
    best = np.argsort(-particles.log_weights, kind="stable")[:n]
    return Particles(particles.values[best], particles.log_weights[best])


def _norm(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=-1)
