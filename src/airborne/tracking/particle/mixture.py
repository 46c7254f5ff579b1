"""The mixture of particle filters: hips (PF1), each shank (PF2), and the best of their combinations.

Block-jump paper, section 3. The shanks of both sides are filtered apart, which the paper's terms allow up to the
distances between them; these are looked up for every combination. How particles move and which distances count is a
set of `Rules`: `Gaussian` here, `BlockJump` beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from airborne.tracking.particle.bootstrap import Particles, equal, resampled, weighed
from airborne.tracking.particle.distances import TORSO_LENGTH_SD_M, length
from airborne.tracking.particle.observations import Look
from airborne.tracking.particle.parts import PELVIS, hip_ends, leg_ends, leg_parts
from airborne.tracking.particle.resampling import SCHEMES
from airborne.tracking.particle.settings import EstimateAs, LegsSettings
from airborne.tracking.particle.situation import TOP, Found, Situation, spread, walk

Array = NDArray[np.floating]

KEPT_HIPS, KEPT_LEGS = 20, 30  # candidates for the combinations


class Belief(NamedTuple):
    """Particles of the three filters; a leg is its knee and ankle."""

    hips: Particles  # (n, 2, 3)
    legs: tuple[Particles, Particles]  # (n, 2, 3) left, right


class Rules(Protocol):
    """How particles move, and what their distances say; all log-likelihoods in nats."""

    def move_hips(self, rng: np.random.Generator, hips: Array, now: Situation) -> Array:
        """Predict hips (n, 2, 3)."""
        ...

    def move_leg(self, rng: np.random.Generator, leg: Array, side: int, now: Situation) -> Array:
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
class Gaussian:
    """Random walks. Of the distances only the rods' fixed lengths count, which make the points a body (section 2.1)."""

    def move_hips(self, rng: np.random.Generator, hips: Array, now: Situation) -> Array:
        """Take a Gaussian step along with the torso, which equation 8 makes the hips depend on."""
        return walk(rng, hips, np.full(2, now.most_m("hips")), now.torso - now.torso_before)

    def move_leg(self, rng: np.random.Generator, leg: Array, side: int, now: Situation) -> Array:
        """Take a Gaussian step."""
        return walk(rng, leg, np.array([now.most_m("knees"), now.most_m("ankles")]), now.shift)

    def hips_terms(self, hips: Array, now: Situation) -> Array:
        """Score L_B2H and L_H (section 3)."""
        return hips_lengths(hips, now)

    def leg_terms(self, leg: Array, side: int, now: Situation) -> Array:
        """Score L_S."""
        return length(_norm(leg[:, 0] - leg[:, 1]), now.legs.shank_m)

    def thigh_terms(self, hip: Array, knee: Array, now: Situation) -> Array:
        """Score L_T."""
        return length(_norm(hip - knee), now.legs.thigh_m)

    def pair_terms(self, left: Array, right: Array, now: Situation) -> Array:
        """Leave the distances between the legs out."""
        return np.zeros(np.broadcast_shapes(left.shape, right.shape)[:-2])


@dataclass(frozen=True, slots=True)
class Mixture:
    """The filters and their combination, for any rules."""

    settings: LegsSettings
    rules: Rules

    def begin(self, points: Array) -> Belief:
        """Return particles that are all at points (6, 3)."""
        hips = equal(np.repeat(points[None, 0:2], self.settings.n_hips, axis=0))
        left, right = (equal(np.repeat(points[None, at], self.settings.n_leg, axis=0)) for at in ([2, 4], [3, 5]))
        return Belief(hips, (left, right))

    def move(self, rng: np.random.Generator, belief: Belief, now: Situation) -> Belief:
        """Resample and predict each filter by itself."""
        scheme, when = SCHEMES[self.settings.resample], self.settings.resample_when
        hips, left, right = (resampled(rng, p, resample=scheme, when=when) for p in (belief.hips, *belief.legs))
        moved_hips = self.rules.move_hips(rng, hips.values, now)
        moved_left, moved_right = (self.rules.move_leg(rng, p.values, s, now) for s, p in enumerate((left, right)))
        return Belief(
            Particles(moved_hips, hips.log_weights),
            (Particles(moved_left, left.log_weights), Particles(moved_right, right.log_weights)),
        )

    def cloud(self, belief: Belief) -> Array:
        """Return all points (n, 3)."""
        return np.concatenate([particles.values.reshape(-1, 3) for particles in (belief.hips, *belief.legs)])

    def weigh(self, belief: Belief, look: Look, now: Situation) -> tuple[Belief, Found]:
        """Weigh the hips, then each leg with the best hip, then every combination of the best of them."""
        of_hips = look.log_likelihood(hip_ends(belief.hips.values), PELVIS).sum(axis=-1)
        hips, _ = weighed(belief.hips, of_hips + self.rules.hips_terms(belief.hips.values, now))
        best = hips.values[np.argmax(hips.log_weights)]
        left, right = (self._weighed_leg(leg, s, best[s], look, now) for s, leg in enumerate(belief.legs))
        return Belief(hips, (left, right)), self._combined(hips, left, right, best, now)

    def _weighed_leg(self, leg: Particles, side: int, hip: Array, look: Look, now: Situation) -> Particles:
        values = leg.values
        of_leg = look.log_likelihood(leg_ends(values), leg_parts(side)).sum(axis=-1)
        thighs = self.rules.thigh_terms(hip, values[:, 0], now)
        return weighed(leg, of_leg + self.rules.leg_terms(values, side, now) + thighs)[0]

    def _combined(self, hips: Particles, left: Particles, right: Particles, best: Array, now: Situation) -> Found:
        hips, left, right = _top(hips, KEPT_HIPS), _top(left, KEPT_LEGS), _top(right, KEPT_LEGS)
        log_weights = (
            hips.log_weights[:, None, None]
            + self._of_leg(hips, left, 0, best, now)[:, :, None]
            + self._of_leg(hips, right, 1, best, now)[:, None, :]
            + self.rules.pair_terms(left.values[:, None], right.values[None, :], now)
        )
        return combination(hips.values, left.values, right.values, log_weights, self.settings.estimate)

    def _of_leg(self, hips: Particles, leg: Particles, side: int, best: Array, now: Situation) -> Array:
        """Return the legs' log-weights with every hip instead of the best one: (hips, legs)."""
        knees = leg.values[:, 0]
        tested = self.rules.thigh_terms(hips.values[:, None, side], knees[None], now)
        return leg.log_weights - self.rules.thigh_terms(best[side], knees, now) + tested


def combination(hips: Array, left: Array, right: Array, log_weights: Array, how: EstimateAs) -> Found:
    """Choose among combinations of hips, left and right legs, each (k, 2, 3), by their log-weights (kh, kl, kr).

    The covariance is that of the points over all combinations, about the chosen ones.
    """
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    shares = weights.sum(axis=(1, 2)), weights.sum(axis=(0, 2)), weights.sum(axis=(0, 1))
    if how == "mean":
        h, lt, rt = (np.tensordot(share, part, 1) for share, part in zip(shares, (hips, left, right), strict=True))
    else:
        top = np.array([np.argmax(weights)]) if how == "max" else np.argsort(-weights, axis=None, kind="stable")[:TOP]
        of_top = weights.ravel()[top] / weights.ravel()[top].sum()
        at = np.unravel_index(top, weights.shape)
        h, lt, rt = (np.tensordot(of_top, part[i], 1) for part, i in zip((hips, left, right), at, strict=True))
    moments = [
        spread(part, share, about) for part, share, about in zip((hips, left, right), shares, (h, lt, rt), strict=True)
    ]
    points = np.array([h[0], h[1], lt[0], rt[0], lt[1], rt[1]])
    return Found(points, np.array([*moments[0], moments[1][0], moments[2][0], moments[1][1], moments[2][1]]))


def hips_lengths(hips: Array, now: Situation) -> Array:
    """Score L_B2H and L_H of hips (n, 2, 3): (n,) [nat]."""
    to_torso = length(_norm(hips.mean(axis=1) - now.torso), now.legs.torso_to_hips_m, TORSO_LENGTH_SD_M)
    return to_torso + length(_norm(hips[:, 0] - hips[:, 1]) / 2, now.legs.half_pelvis_m)


def _top(particles: Particles, n: int) -> Particles:
    best = np.argsort(-particles.log_weights, kind="stable")[:n]
    return Particles(particles.values[best], particles.log_weights[best])


def _norm(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=-1)
