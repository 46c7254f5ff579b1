"""Gauss-Newton on evidence maps: a jumper moves until nothing more is gained at its outlines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.kernels import kernel
from airborne.tracking.capsules.equations import N_CAPSULES, N_POINTS, gathered, kinds_with
from airborne.tracking.capsules.jumper import BALL_HEIGHT_M, LIMITS_RAD, N_DOF
from airborne.tracking.capsules.views import Seen, workspace

Array = NDArray[np.floating]

NATS_PER_M2 = 240.0  # neighbouring pixels err together: what an area on the body is worth for each nat of theirs
SHAPE_SD_M = 0.050  # how far a capsule's outline may lie beside the player's
SLOPE = 0.25  # share of its contrast by which evidence falls across an outline in a pixel of the maps
_LIMIT_SD_RAD = 0.05  # how firmly joints keep within their limits
_FLOOR_SD_M = 0.01  # and feet above the floor
_SETTLED_NATS = 0.1
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 0.1, 0.03, 2.0  # of a first step; steps shorter than the last change nothing
_ROBUST = 4.0  # squared sds at which an anchor's pull is halved
_BALLS = (6, 7)  # rows of the points
# how people hold themselves, weakly: upright, legs under the hips, both bent alike
_HABIT_SD = np.array([0.2, 0.5, 0.3, 0.15] + [0.25, 0.3, 0.4] * 2 + [0.5, 0.6])
_HABITS = np.zeros((len(_HABIT_SD), N_DOF))
_HABITS[np.arange(10), [4, 5, 6, 7, 9, 10, 12, 14, 15, 17]] = 1  # side and forward lean, bends, hip y and z, ankle
_HABITS[10, [8, 13]] = _HABITS[11, [11, 16]] = 1, -1  # hip and knee flexion, left less right
_HABIT_INFORMATION = _HABITS.T @ (_HABITS / _HABIT_SD[:, None] ** 2)
_REST = np.zeros(N_DOF)
_REST[5] = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is known before looking: a Gaussian over the first numbers of the state, and anchors of points."""

    mean: Array  # (n_free,)
    information: Array  # (n_free, n_free), the inverse of its covariance
    anchors: Array | None = None  # (9, 3) [m]; NaN where there is none
    anchor_sd_m: Array | None = None  # (9,) [m]


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where a jumper was found."""

    state: Array  # (35,)
    information: Array  # (n_free, n_free) of pictures and prior together
    by_shape: Array  # (n_free, n_free) covariance from outlines that are not the player's
    points: Array  # (9, 3) [m]
    by_state: Array  # (27, n_free) how the points move with the state
    nats: float  # evidence, worth of a pixel taken in
    total: float  # nats and the prior's
    owned: Array  # (v, 10, 2, 2) evidence and area [px of the maps] of each capsule's two kinds


class _Place(NamedTuple):
    """One state, and all that is known of it there."""

    state: Array  # (35,)
    totals: Array  # (2,) nats of the pictures, and with the prior
    pull: Array  # (n_free,) the gradient of the second
    information: Array  # (n_free, n_free) its curvature
    owned: Array  # (v, 10 + others, 2, 2)
    equations: tuple[Array, Array, Array, Array, Array]  # see `gathered`


def fit(state: Array, prior: Prior, found: Seen, others: tuple[Array, Array], *, most_steps: int = 10) -> Fit:
    """Move the first len(prior.mean) numbers of a state to the nearest maximum of evidence and prior."""
    n = len(prior.mean)
    work, owned = workspace(found, len(others[0]))
    pictures = found.cameras, kinds_with(others), found.maps, others, work
    anchors = np.full((N_POINTS, 3), np.nan) if prior.anchors is None else prior.anchors
    sd_m = np.ones(N_POINTS) if prior.anchor_sd_m is None else prior.anchor_sd_m
    known = prior.mean, np.ascontiguousarray(prior.information), anchors, sd_m, _HABIT_INFORMATION
    worth = _worth(found)
    best = _climbed(_place(state, n, owned), _place(state, n, owned), known, pictures, worth, most_steps)
    points, by_state, _, _, spread = best.equations
    inverse = np.linalg.inv(best.information)
    return Fit(
        state=best.state,
        information=best.information,
        by_shape=(SHAPE_SD_M * worth * SLOPE) ** 2 * inverse @ spread @ inverse,
        points=points,
        by_state=by_state,
        nats=float(best.totals[0]),
        total=float(best.totals[1]),
        owned=best.owned[:, :N_CAPSULES],
    )


def scored(state: Array, found: Seen, others: tuple[Array, Array]) -> float:
    """Return the evidence of a state [nat], without any prior."""
    work, owned = workspace(found, len(others[0]))
    nothing = np.empty((N_POINTS, 3)), np.empty((27, 0)), np.empty(0), np.empty((0, 0)), np.empty((0, 0))
    return _worth(found) * gathered(
        state, 0, found.cameras, kinds_with(others), found.maps, others, work, owned, nothing
    )


def _worth(found: Seen) -> float:
    return NATS_PER_M2 / found.scale.px_per_m**2


def _place(state: Array, n: int, owned: Array) -> _Place:
    equations = np.empty((N_POINTS, 3)), np.empty((3 * N_POINTS, n)), np.empty(n), np.empty((n, n)), np.empty((n, n))
    return _Place(state.copy(), np.empty(2), np.empty(n), np.empty((n, n)), owned.copy(), equations)


@kernel
def _climbed(best, tried, known, pictures, worth, most_steps):
    """Go from the place `best` up to the nearest maximum and return that one of the two places where it is known."""
    n, damping = len(best.pull), _DAMPING
    _evaluate(best, known, pictures, worth)
    for _ in range(most_steps):
        damped = best.information.copy()
        for k in range(n):
            damped[k, k] += damping * damped[k, k]
        step = np.linalg.solve(damped, best.pull)
        tried.state[:] = best.state
        tried.state[:n] += step
        _evaluate(tried, known, pictures, worth)
        gain = tried.totals[1] - best.totals[1]
        if gain > 0:
            best, tried = tried, best
            damping = max(damping / 4, _LEAST_DAMPING)
        else:
            damping = max(damping * 4, 0.25)
        if 0 < gain < _SETTLED_NATS or damping > _MOST_DAMPING:
            break
    return best


@kernel
def _evaluate(at, known, pictures, worth):
    """Look at the pictures from a place's state, weigh in what is `known`, and fill the rest of the place."""
    mean, information, anchors, anchor_sd_m, habits = known
    cameras, kinds, maps, others, work = pictures
    points, by_state, gradient, curvature, _ = at.equations
    state, n, A, b = at.state, len(mean), at.information, at.pull
    nats = worth * gathered(state, n, cameras, kinds, maps, others, work, at.owned, at.equations)
    away = state[:n] - mean
    held = information @ away
    from_rest = _REST - state[:N_DOF]
    to_rest = habits @ from_rest
    A[:] = worth * SLOPE * curvature + information
    b[:] = worth * gradient - held
    A[:N_DOF, :N_DOF] += habits
    b[:N_DOF] += to_rest
    cost = 0.5 * (away @ held + from_rest @ to_rest)
    for k in range(N_DOF):
        beyond = min(max(state[k], LIMITS_RAD[k, 0]), LIMITS_RAD[k, 1]) - state[k]
        if beyond != 0:
            A[k, k] += 1 / _LIMIT_SD_RAD**2
            b[k] += beyond / _LIMIT_SD_RAD**2
            cost += 0.5 * (beyond / _LIMIT_SD_RAD) ** 2
    for ball in _BALLS:
        sunk = BALL_HEIGHT_M - points[ball, 2]
        if sunk > 0:
            _add(by_state[3 * ball + 2], sunk, 1 / _FLOOR_SD_M**2, A, b)
            cost += 0.5 * (sunk / _FLOOR_SD_M) ** 2
    for i in range(N_POINTS):
        if np.isfinite(anchors[i]).all():
            off = anchors[i] - points[i]
            squared = off @ off / anchor_sd_m[i] ** 2 / 3
            for p in range(3):
                _add(by_state[3 * i + p], off[p], 1 / (anchor_sd_m[i] ** 2 * (1 + squared / _ROBUST)), A, b)
            cost += 1.5 * _ROBUST * np.log1p(squared / _ROBUST)
    at.totals[0], at.totals[1] = nats, nats - cost


@kernel
def _add(row, target, weight, A, b):
    """Add to the normal equations that row (n,) times the step should be `target`."""
    for i in range(len(row)):
        b[i] += weight * target * row[i]
        for j in range(len(row)):
            A[i, j] += weight * row[i] * row[j]
