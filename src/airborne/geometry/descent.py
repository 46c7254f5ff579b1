"""Descent on a cost whose steps are solved from normal equations: one loop, and named rules for how far a step goes.

Levenberg and Marquardt's method damps the equations, by `MarquardtRule` or `NielsenRule`; Gauss-Newton's steps are
shortened, by `BacktrackingRule`. What an iterate is, and how it is evaluated, is the caller's. No arrays are touched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Generic, Protocol, TypeVar


class Outcome(StrEnum):
    """Why a descent ended."""

    CONVERGED = "a further step gains next to nothing"
    STUCK = "no step gains anything, however short"
    OUT_OF_STEPS = "the most steps were taken"


class Rule(Protocol):
    """How a number, the damping of the equations or the share of the step, follows from the steps tried before."""

    @property
    def first(self) -> float:
        """The number of the first step."""
        ...

    def after_gain(self, value: float, ratio: float) -> float:
        """Return the number after a step that gained `ratio` times the predicted decrease."""
        ...

    def after_loss(self, value: float, n_losses: int) -> float:
        """Return the number after the last step lost, the `n_losses`-th since a gain."""
        ...

    def is_exhausted(self, value: float) -> bool:
        """Whether no further step is worth trying."""
        ...


@dataclass(frozen=True, slots=True)
class MarquardtRule:
    """Damping by constant factors (Marquardt 1963)."""

    first: float
    down: float  # divides it after a gain
    up: float  # multiplies it after a loss
    least: float
    most: float

    def after_gain(self, value: float, ratio: float) -> float:
        """Return the damping after a gain, whatever the ratio."""
        return max(value / self.down, self.least)

    def after_loss(self, value: float, n_losses: int) -> float:
        """Return the damping after a loss."""
        return value * self.up

    def is_exhausted(self, value: float) -> bool:
        """Whether the damping is above the most."""
        return value > self.most


@dataclass(frozen=True, slots=True)
class NielsenRule:
    """Damping by the gain ratio, and ever faster from loss to loss (Nielsen 1999)."""

    first: float
    least: float
    most: float
    least_factor: float  # after a gain as large as predicted

    def after_gain(self, value: float, ratio: float) -> float:
        """Return the damping: less for a ratio above one half, more below."""
        return max(value * max(self.least_factor, 1 - (2 * min(ratio, 1.0) - 1) ** 3), self.least)

    def after_loss(self, value: float, n_losses: int) -> float:
        """Return the damping, times 2, 4, 8, ... from loss to loss."""
        return value * 2.0**n_losses

    def is_exhausted(self, value: float) -> bool:
        """Whether the damping is above the most."""
        return value > self.most


@dataclass(frozen=True, slots=True)
class BacktrackingRule:
    """The share of the undamped step: the whole at every new iterate, shorter after each loss, down to the least."""

    factor: float
    least: float

    @property
    def first(self) -> float:
        """The whole step."""
        return 1.0

    def after_gain(self, value: float, ratio: float) -> float:
        """Return the whole step."""
        return 1.0

    def after_loss(self, value: float, n_losses: int) -> float:
        """Return a smaller share."""
        return value * self.factor

    def is_exhausted(self, value: float) -> bool:
        """Whether the share is below the least."""
        return value < self.least


class Iterate(Protocol):
    """Where a descent may be."""

    def cost(self, reference: Any, /) -> float:
        """Return the cost here, as measured with what the reference, another iterate, says of the noise."""
        ...

    def step(self, value: float, /) -> tuple[Any, float]:
        """Return where a step leads, damped or shortened by the rule, and the predicted decrease of the cost."""
        ...


IterateT = TypeVar("IterateT", bound=Iterate)


@dataclass(frozen=True, slots=True, eq=False)
class Descent(Generic[IterateT]):
    """Where a descent ended, and why."""

    best: IterateT
    outcome: Outcome
    n_steps: int  # tried
    n_losses: int  # since the best was reached


def descend(
    first: IterateT,
    evaluate: Callable[[Any], IterateT],
    rule: Rule,
    *,
    most_steps: int,
    least_predicted: tuple[float, float] | None = None,
    least_gain: float = 0.0,
    slack: float = 0.0,
    progress: Callable[[int, float], None] | None = None,
) -> Descent[IterateT]:
    """Step downhill from the first iterate until the predicted decrease, or the last gain, is next to nothing.

    least_predicted: decrease of the cost, absolute and as a share of it. least_gain, a share of the cost, ends the
    descent after a smaller gain. slack: a cost larger by this share still counts as a gain, where it fluctuates.
    progress takes the steps tried and the cost at every gain.
    """
    best, value, n_losses = first, rule.first, 0
    cost, n = first.cost(first), 0
    while n < most_steps:
        if rule.is_exhausted(value):
            return Descent(best, Outcome.STUCK, n, n_losses)
        following, predicted = best.step(value)
        if least_predicted is not None and predicted <= least_predicted[0] + least_predicted[1] * cost:
            return Descent(best, Outcome.CONVERGED, n, n_losses)
        trial = evaluate(following)
        new, n = trial.cost(best), n + 1
        if not new < cost * (1 + slack):
            n_losses += 1
            value = rule.after_loss(value, n_losses)
            continue
        gain, best, n_losses = cost - new, trial, 0
        value = rule.after_gain(value, gain / predicted)
        cost = trial.cost(trial)
        if progress is not None:
            progress(n, cost)
        if gain < least_gain * cost:
            return Descent(best, Outcome.CONVERGED, n, n_losses)
    return Descent(best, Outcome.OUT_OF_STEPS, n, n_losses)
