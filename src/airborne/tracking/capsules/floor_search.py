"""Where players stand: stances on a grid of the floor, one after the other, each improved by what its model tells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airborne.tracking.capsules.standing import (
    STANCE_SD,
    ColourViews,
    X,
    Y,
    clip_stances,
    implausibility,
    stance,
    states_of,
)
from airborne.types import Array
from airborne.video import View

_GRID_M = 0.15  # between stances on the floor
_KNEES = (0.4, 0.8, 1.2)  # [rad] the crouches on the grid
_FACING = np.pi  # toward the net, on the grid
_HEADINGS = (np.pi, 0.0)  # from which a stance is improved
_APART_M = 0.5  # of two players on the grid
_LEAST_SUPPORT = 0.7  # [nat m2] on the grid; what tells less is nobody
_LEAST_STANDING = 0.9  # [nat m2] on the grid, what is more counts for a moment: ghosts between players tell less
_LEAST_OF_SOMEBODY = 1.1  # [nat m2] of somebody whom nobody expects, see `tracking.first_pose.players`
_MOST_PLAYERS = 16  # of two teams with their substitutes on the floor
_AS_WELL = 0.95  # share of what the best stance tells, with which another is kept
_N_DRAWS, _N_BEST, _N_ROUNDS = 150, 20, 12  # of the cross-entropy search
_RATE, _LEAST_SHARE = 0.7, 0.03  # of a new mean and spread; least spread, of the first


@dataclass(frozen=True, slots=True, eq=False)
class Stander:
    """A player who was found standing."""

    support: Array  # (n,) what its stances tell [nat m2], the best first
    stances: Array  # (n, 18) the same
    states: Array  # (n, 35) of the same

    @property
    def floor_m(self) -> Array:
        """Where the middle of the hips lies over the floor: (2,) [m]."""
        return self.states[0, :2]


def floor_grid(zone: Array) -> Array:
    """Return places on a grid of a zone (2, 2) of the floor: (n, 2) [m]."""
    x, y = (np.arange(low, high + _GRID_M / 2, _GRID_M) for low, high in zone.T)
    return np.array([(a, b) for a in x for b in y])


def evaluate_grid(views: ColourViews, places: Array) -> tuple[Array, Array]:
    """Return stances (n, 18) at places (n, 2) on the floor, and what each tells (n,) [nat m2]."""
    support, stances = [], []
    for knee in _KNEES:
        stances.append(np.array([stance(a, b, _FACING, knee) for a, b in places]))
        support.append(views.support(states_of(stances[-1])))
    best = np.argmax(support, axis=0)
    return np.stack(stances)[best, np.arange(len(best))], np.max(support, axis=0)


def find_standers(views: ColourViews, places: Array, wanted: Array) -> Iterator[Stander]:
    """Yield players about places (n, 2) on the floor, from the one who tells most.

    The pixels of each are explained and taken away before the next. Those outside the `wanted` zone are only looked at
    as facing the net.
    """
    stances, support = evaluate_grid(views, places)
    for _ in range(_MOST_PLAYERS):
        while True:
            best = int(support.argmax())
            if support[best] < _LEAST_SUPPORT:
                return
            now = float(views.support(states_of(stances[best : best + 1]))[0])
            if now >= support[best] - 1e-9:
                break
            support[best] = now  # others were found since: what is left of it
        stander = _improve(views, _starts(stances[best]) if lies_in(wanted, stances[best, :2]) else stances[best, None])
        yield stander
        views = views.without(stander.states[0])
        support[best] = 0.0


def find_others(
    views: Sequence[View], known: Sequence[Array], *, zone: Array, places: Array, wanted: Array
) -> list[Stander]:
    """Find who stands about places (n, 2) beside those who are known, states (35,): players, not ghosts between them.

    Colours are those of a zone (2, 2); wanted: as `find_standers` takes it.
    """
    colours = ColourViews.of(views, zone)
    for state in known:
        colours = colours.without(state)
    return [each for each in find_standers(colours, places, wanted) if each.support[0] > _LEAST_OF_SOMEBODY]


def lies_in(zone: Array, floor_m: Array) -> bool:
    """Return whether a place (2,) lies in a zone of the floor, from and to x, y: (2, 2) [m]."""
    return bool(np.all((floor_m >= zone[0]) & (floor_m <= zone[1])))


def _starts(at: Array) -> Array:
    """Return stances (n, 18) at the place of one: facing the net and away from it, in all crouches of the grid."""
    return np.array([stance(at[X], at[Y], heading, knee) for heading in _HEADINGS for knee in _KNEES])


def _improve(views: ColourViews, starts: Array) -> Stander:
    """Improve stances (n, 18) of one player; those that tell nearly as much as the best are kept."""
    ends = sorted((_climb(views, start) for start in starts), key=lambda end: -end[1])
    ends = [end for end in ends if end[1] > _AS_WELL * ends[0][1]]
    stances = np.array([best for best, _ in ends])
    return Stander(np.array([support for _, support in ends]), stances, states_of(stances))


def _climb(views: ColourViews, start: Array) -> tuple[Array, float]:
    """Search about a stance by the cross-entropy method; return the best one met, and what it tells [nat m2]."""
    rng, mean, sd = np.random.default_rng(0), start, STANCE_SD
    best, most = start, -np.inf
    for _ in range(_N_ROUNDS):
        drawn = clip_stances(np.vstack([best, mean, mean + sd * rng.standard_normal((_N_DRAWS, len(mean)))]))
        support = views.support(states_of(drawn)) - implausibility(drawn)
        order = np.argsort(-support)[:_N_BEST]
        if support[order[0]] > most:
            best, most = drawn[order[0]], float(support[order[0]])
        mean = mean + _RATE * (drawn[order].mean(axis=0) - mean)
        sd = np.maximum(sd + _RATE * (drawn[order].std(axis=0) - sd), _LEAST_SHARE * STANCE_SD)
    return best, most


def sum_support(stances: Array, support: Array) -> float:
    """Return by how much players on a grid tell more than ghosts, in all [nat m2]."""
    total, kept = 0.0, np.empty((0, 2))
    for i in np.argsort(-support):
        if support[i] < _LEAST_STANDING:
            break
        if np.all(np.linalg.norm(kept - stances[i, :2], axis=1) > _APART_M):
            kept = np.vstack([kept, stances[i, :2]])
            total += float(support[i]) - _LEAST_STANDING
    return total
