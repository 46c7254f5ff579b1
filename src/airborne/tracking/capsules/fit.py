"""Gauss-Newton on evidence maps: maximises evidence and prior of a jumper's state, with Levenberg-Marquardt damping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from airborne.kernels import kernel
from airborne.kernels.arrays import add, assign, solve_positive
from airborne.tracking.capsules.equations import N_CAPSULES, N_POINTS, accumulate_equations, classes_with
from airborne.tracking.capsules.jumper import FOOT_HEIGHT_M, LIMITS_RAD, N_DOF
from airborne.tracking.capsules.kernel_arguments import Capsules, Equations, Images, SummedMaps, Workspace
from airborne.tracking.capsules.views import RegionMaps
from airborne.types import Array

_NATS_PER_M2 = 240.0  # weight of an area on the body per nat of its pixels, whose errors are correlated
_OUTLINE_SD_M = 0.050  # of a capsule's outline about the player's
_SLOPE = 0.25  # evidence falls across an outline by this share of its contrast per pixel of the maps
_LIMIT_SD_RAD = 0.05  # of a joint beyond its limits
_FLOOR_SD_M = 0.01  # of a foot below the floor
_CONVERGED_NATS = 0.1  # a step that gains less ends the iteration
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 0.1, 0.03, 2.0  # first, least, most
_CAUCHY_SCALE = 4.0  # squared sds at which an anchor's weight is halved
_FEET = (6, 7)  # rows of the points
# weak prior of the posture: upright, legs under the hips, both bent alike
# chosen by hand; without it the joints err by 21.6 mm, not 20.9: blocker_variants.csv, without habits
_POSTURE_SD = np.array([0.2, 0.5, 0.3, 0.15] + [0.25, 0.3, 0.4] * 2 + [0.5, 0.6])
_POSTURE = np.zeros((len(_POSTURE_SD), N_DOF))
_POSTURE[np.arange(10), [4, 5, 6, 7, 9, 10, 12, 14, 15, 17]] = 1  # side and forward lean, bends, hip y and z, ankle
_POSTURE[10, [8, 13]] = _POSTURE[11, [11, 16]] = 1, -1  # hip and knee flexion, left less right
POSTURE_INFORMATION = _POSTURE.T @ (_POSTURE / _POSTURE_SD[:, None] ** 2)
_REST_POSE = np.zeros(N_DOF)
_REST_POSE[5] = 0.25  # [rad] the trunk leans forward


@dataclass(frozen=True, slots=True, eq=False)
class JumperPrior:
    """A Gaussian prior over the first numbers of the state, and anchors of points."""

    mean: Array  # (n_free,)
    information: Array  # (n_free, n_free), the inverse of the covariance
    anchors: Array | None = None  # (9, 3) [m]; NaN where there is none
    anchor_sd_m: Array | None = None  # (9,) [m]


@dataclass(frozen=True, slots=True, eq=False)
class JumperFit:
    """A jumper's maximum a posteriori state."""

    state: Array  # (35,)
    information: Array  # (n_free, n_free) information matrix of images and prior
    model_error_covariance: Array  # (n_free, n_free) of the state, from errors of the outlines
    points: Array  # (9, 3) [m]
    jacobian: Array  # (27, n_free) of the points by the state
    nats: float  # weighted evidence
    total: float  # nats with the prior
    owned: Array  # (v, 10, 2, 2) evidence and area [px of the maps] of each capsule's two classes
    cameras: Array  # (v, 4, 4) of the regions, see `RegionMaps`


class _Priors(NamedTuple):
    """What is known of a state beside the images; see `JumperPrior`."""

    mean: Array
    information: Array
    anchors: Array
    anchor_sd_m: Array
    posture: Array  # (18, 18) information about the resting pose


class _Iterate(NamedTuple):
    """A state, with the objective and its normal equations there."""

    state: Array  # (35,)
    totals: Array  # (2,) nats of the images, and with the prior
    gradient: Array  # (n_free,) of the second
    information: Array  # (n_free, n_free) its Gauss-Newton curvature
    owned: Array  # (v, 10 + others, 2, 2)
    equations: Equations


def fit_jumper(
    state: Array, prior: JumperPrior, region_maps: RegionMaps, others: Capsules, *, most_steps: int = 10
) -> JumperFit:
    """Move the first len(prior.mean) numbers of a state to the nearest maximum of evidence and prior."""
    n = len(prior.mean)
    images, owned = _images(region_maps, others)
    anchors = np.full((N_POINTS, 3), np.nan) if prior.anchors is None else prior.anchors
    sd_m = np.ones(N_POINTS) if prior.anchor_sd_m is None else prior.anchor_sd_m
    priors = _Priors(prior.mean, np.ascontiguousarray(prior.information), anchors, sd_m, POSTURE_INFORMATION)
    weight = pixel_weight(region_maps)
    best = _maximise(
        _allocate_iterate(state, n, owned), _allocate_iterate(state, n, owned), priors, images, weight, most_steps
    )
    inverse, equations = np.linalg.inv(best.information), best.equations
    return JumperFit(
        state=best.state,
        information=best.information,
        model_error_covariance=(_OUTLINE_SD_M * weight * _SLOPE) ** 2 * inverse @ equations.score_covariance @ inverse,
        points=equations.points,
        jacobian=equations.jacobian,
        nats=float(best.totals[0]),
        total=float(best.totals[1]),
        owned=best.owned[:, :N_CAPSULES],
        cameras=region_maps.cameras,
    )


def evidence_of(state: Array, region_maps: RegionMaps, others: Capsules) -> float:
    """Return the evidence of a state [nat], without any prior."""
    images, owned = _images(region_maps, others)
    return pixel_weight(region_maps) * accumulate_equations(state, 0, images, owned, Equations.of(N_POINTS, 0))


def view_equations(state: Array, region_maps: RegionMaps, others: Capsules, n: int) -> tuple[Array, Array]:
    """Return what each view alone says of a state's first n numbers: information (v, n, n), gradient (v, n) [nat]."""
    weight, v = pixel_weight(region_maps), len(region_maps.cameras)
    information, gradient = np.zeros((v, n, n)), np.zeros((v, n))
    for k in range(v):
        images, owned = _images(select_views(region_maps, [k]), others)
        equations = Equations.of(N_POINTS, n)
        accumulate_equations(state, n, images, owned, equations)
        information[k], gradient[k] = weight * _SLOPE * equations.curvature, weight * equations.gradient
    return information, gradient


def select_views(region_maps: RegionMaps, which: Sequence[int]) -> RegionMaps:
    """Return the maps of some of the regions."""
    rows = list(which)
    return replace(
        region_maps,
        cameras=region_maps.cameras[rows],
        sums=region_maps.sums[rows],
        contrast=region_maps.contrast[rows],
    )


def _images(region_maps: RegionMaps, others: Capsules) -> tuple[Images, Array]:
    """Return the kernels' images, and an array for what each capsule owns of them."""
    n, (v, _, h, _) = N_CAPSULES + len(others.ends), region_maps.sums.shape
    maps = SummedMaps(region_maps.sums, region_maps.contrast)
    images = Images(region_maps.cameras, maps, others, classes_with(others), Workspace.of(n, h))
    return images, np.zeros((v, n, 2, 2))


def pixel_weight(region_maps: RegionMaps) -> float:
    """Return the weight of a pixel of the maps per nat of its evidence."""
    return _NATS_PER_M2 / region_maps.scale.px_per_m**2


def _allocate_iterate(state: Array, n: int, owned: Array) -> _Iterate:
    return _Iterate(state.copy(), np.empty(2), np.empty(n), np.empty((n, n)), owned.copy(), Equations.of(N_POINTS, n))


@kernel
def _maximise(best, trial, priors, images, weight, most_steps):
    """Climb from the iterate `best` to the nearest maximum; return whichever of the two iterates holds it."""
    n, damping = len(best.gradient), _DAMPING
    _evaluate(best, priors, images, weight)
    for _ in range(most_steps):
        damped = best.information.copy()
        for k in range(n):
            damped[k, k] += damping * damped[k, k]
        step = best.gradient.copy()
        solve_positive(damped, step)
        assign(trial.state, best.state)
        add(trial.state[:n], step)
        _evaluate(trial, priors, images, weight)
        gain = trial.totals[1] - best.totals[1]
        if gain > 0:
            best, trial = trial, best
            damping = max(damping / 4, _LEAST_DAMPING)
        else:
            damping = max(damping * 4, 0.25)
        if 0 < gain < _CONVERGED_NATS or damping > _MOST_DAMPING:
            break
    return best


@kernel(is_inner=True)
def _evaluate(iterate, priors, images, weight):
    """Evaluate the evidence at an iterate's state, add the priors, and fill the rest of the iterate."""
    anchors, anchor_sd_m = priors.anchors, priors.anchor_sd_m
    points, jacobian = iterate.equations.points, iterate.equations.jacobian
    state, n, A, b = iterate.state, len(priors.mean), iterate.information, iterate.gradient
    nats = weight * accumulate_equations(state, n, images, iterate.owned, iterate.equations)
    deviation = state[:n] - priors.mean
    prior_gradient = priors.information @ deviation
    posture_deviation = _REST_POSE - state[:N_DOF]
    posture_gradient = priors.posture @ posture_deviation
    assign(A, weight * _SLOPE * iterate.equations.curvature + priors.information)
    assign(b, weight * iterate.equations.gradient - prior_gradient)
    add(A[:N_DOF, :N_DOF], priors.posture)
    add(b[:N_DOF], posture_gradient)
    cost = 0.5 * (deviation @ prior_gradient + posture_deviation @ posture_gradient)
    for k in range(N_DOF):
        beyond = min(max(state[k], LIMITS_RAD[k, 0]), LIMITS_RAD[k, 1]) - state[k]
        if beyond != 0:
            A[k, k] += 1 / _LIMIT_SD_RAD**2
            b[k] += beyond / _LIMIT_SD_RAD**2
            cost += 0.5 * (beyond / _LIMIT_SD_RAD) ** 2
    for foot in _FEET:
        depth_m = FOOT_HEIGHT_M - points[foot, 2]
        if depth_m > 0:
            _add(jacobian[3 * foot + 2], depth_m, 1 / _FLOOR_SD_M**2, A, b)
            cost += 0.5 * (depth_m / _FLOOR_SD_M) ** 2
    for i in range(N_POINTS):
        if np.isfinite(anchors[i]).all():
            off = anchors[i] - points[i]
            squared = off @ off / anchor_sd_m[i] ** 2 / 3
            for p in range(3):
                _add(jacobian[3 * i + p], off[p], 1 / (anchor_sd_m[i] ** 2 * (1 + squared / _CAUCHY_SCALE)), A, b)
            cost += 1.5 * _CAUCHY_SCALE * np.log1p(squared / _CAUCHY_SCALE)
    iterate.totals[0], iterate.totals[1] = nats, nats - cost


@kernel
def _add(row, target, weight, A, b):
    """Add an observation to the normal equations: row (n,) times the step is `target`."""
    for i in range(len(row)):
        b[i] += weight * target * row[i]
        for j in range(len(row)):
            A[i, j] += weight * row[i] * row[j]
