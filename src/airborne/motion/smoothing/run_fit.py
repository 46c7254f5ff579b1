"""The most probable motion: a whole run fitted at once to its images and to how bodies move.

The poses of all frames are unknown together. Each frame's images are evidence about its own pose; between frames the
accelerations of the root and of every joint are white noise, and in flight mass falls and momentum is constant. Each
Gauss-Newton step linearises both anew, about all poses of the run, and solves one banded system. So a frame is fitted
with what the images before and after it show, and no image counts twice, as it does through a tracker's predictions.
Batch estimation: Barfoot 2017, "State Estimation for Robotics", sections 3.1 and 4.3; white accelerations: Bar-Shalom,
Li and Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", section 6.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.body import BodyModel, Pose
from airborne.body.chain import delta_between, move_pose
from airborne.constants import FREE_FALL_M_S2
from airborne.geometry.banded_equations import BandedEquations, JoiningRows
from airborne.geometry.descent import BacktrackingRule, descend
from airborne.motion.smoothing.conservation import fall_offset_m, fall_rows, momentum_rows
from airborne.motion.smoothing.free_rotation import TRUNK
from airborne.tracking.model_based.image_evidence import ImageEvidence
from airborne.types import Array

Look = Callable[[Sequence[Pose]], Sequence[ImageEvidence]]  # one pass over the images of a run, a pose each frame

# spectral densities of accelerations [m2/s3, rad2/s3], chosen: of limbs an sd of 120 rad/s2 at 50 frames/s. On two
# synthetic people who tuck and open in 0.17 s joints err by 10.6 and 16.0 mm without constant offsets, with 30 by 12.4
# and 18.6, and knees open too early and too slowly; on four slower people both err alike
_DENSITY = 120.0**2 / 50
# chosen, of the root, m/s2 and rad/s2, and of hands, feet and head, whose turns are seen least: with 120 the root's
# rotation errs by 3 % more on those people, and joints by 1 %
_SLOW_DENSITY = 30.0**2 / 50
_SLOW = ("head", "hand_left", "hand_right", "foot_left", "foot_right")
_TRUNK_DENSITY = 10.0**2 / 50  # of the trunk's joints: with 30 rad/s2 joints err by 0.7 % more; with 5 the largest do
_DAMPING = 1e-4  # [1/m2, 1/rad2] holds what neither images nor neighbours show
N_STEPS = 4  # on seven synthetic somersaults errors fall up to the fourth; further steps fit what images have wrong
_SHORTER, _LEAST_SHARE = 0.4, 0.1  # factor on a step that does not lower the cost, and the least share of one
_SLACK = 3e-3  # of the cost: the refitted light makes it fluctuate by up to 2e-3 on synthetic somersaults


@dataclass(frozen=True, slots=True)
class Stretch:
    """Frames between which motion is smooth, three or more, and whether the body falls freely there: then four."""

    rows: slice
    falls: bool


class SmoothErrors(NamedTuple):
    """The errors of the poses of a fitted run."""

    covariances: Array  # (n, d, d)
    of_surface: Array  # (n, d, k) what errors of the surface of an sd each, which last all run long, do to the poses


class RunFit(NamedTuple):
    """The most probable poses of a run, and what its images said about those before the last step."""

    poses: Sequence[Pose]
    evidence: Sequence[ImageEvidence]


def fit_run(
    model: BodyModel,
    poses: Sequence[Pose],
    time_s: Array,
    stretches: Sequence[Stretch],
    look: Look,
    *,
    n_steps: int = N_STEPS,
) -> RunFit:
    """Fit the poses at the times (n,) [s], which are near already; outside of stretches they stay.

    The last step is not looked at any more.
    """

    def evaluate(poses: Sequence[Pose]) -> _Iterate:
        return _Iterate(model, poses, time_s, stretches, look(poses))

    rule = BacktrackingRule(_SHORTER, _LEAST_SHARE)
    descent = descend(evaluate(poses), evaluate, rule, most_steps=n_steps - 1, slack=_SLACK)
    best = descent.best
    return RunFit(best.poses if descent.n_losses else best.step(1.0)[0], best.evidence)


def smooth_errors(
    model: BodyModel, fit: RunFit, time_s: Array, stretches: Sequence[Stretch], covariances: Array
) -> SmoothErrors:
    """Return the errors of the poses of a fitted run, from the covariances of its frames by themselves: (n, d, d).

    To smooth motion the errors of single frames are noise, of which it leaves little. Errors of the surface last all
    run long: they pass the fit as they are, and are added. A direction that a frame leaves open stays open.
    """
    fitted, of_surface = covariances.copy(), np.zeros((*covariances.shape[:2], len(fit.evidence[0].of_shape)))
    for stretch in stretches:
        rows, damping = stretch.rows, _DAMPING * np.eye(model.n_dofs)
        joining = _joining_rows(model, fit.poses, time_s, stretch)
        own = np.array([invert_known(each) + damping for each in covariances[rows]])
        left = BandedEquations.of(own, np.zeros(own.shape[:2]), *joining).covariances()
        own = np.array([each.information + damping for each in fit.evidence[rows]])
        of_shape = np.array([each.of_shape.T for each in fit.evidence[rows]])
        of_surface[rows] = moved = BandedEquations.of(own, np.zeros(own.shape[:2]), *joining).solve(of_shape)
        fitted[rows] = np.where(np.isfinite(covariances[rows]), left + moved @ moved.swapaxes(1, 2), covariances[rows])
    return SmoothErrors(fitted, of_surface)


def invert_known(covariance: Array) -> Array:
    """Invert a covariance (d, d); directions of infinite or unknown variance give no information."""
    known = np.isfinite(np.diagonal(covariance))
    information = np.zeros_like(covariance)
    information[np.ix_(known, known)] = np.linalg.inv(covariance[np.ix_(known, known)])
    return information


def _joining_rows(model: BodyModel, poses: Sequence[Pose], time_s: Array, stretch: Stretch) -> list[JoiningRows]:
    """Return what joins the frames of a stretch."""
    poses, time_s = poses[stretch.rows], time_s[stretch.rows]
    rows = acceleration_rows(model, poses, time_s, FREE_FALL_M_S2 if stretch.falls else np.zeros(3))
    if not stretch.falls:
        return [rows]
    fall = fall_rows(model, poses, time_s, fall_offset_m(model, poses, time_s))
    return [rows, fall, momentum_rows(model, poses, time_s)]


@dataclass(frozen=True, eq=False)
class _Iterate:
    """All poses of a run, and what the images say about them."""

    model: BodyModel
    poses: Sequence[Pose]
    time_s: Array  # (n,)
    stretches: Sequence[Stretch]
    evidence: Sequence[ImageEvidence]

    @cached_property
    def _joining(self) -> list[list[JoiningRows]]:
        """What joins the frames of each stretch."""
        return [_joining_rows(self.model, self.poses, self.time_s, stretch) for stretch in self.stretches]

    def cost(self, reference: _Iterate) -> float:
        """Return minus the log-posterior [nat]."""
        of_motion = sum(float(np.sum(each.values**2)) for joining in self._joining for each in joining) / 2
        return of_motion + sum(each.cost for stretch in self.stretches for each in self.evidence[stretch.rows])

    @cached_property
    def _step(self) -> tuple[Array, float]:
        """The whole step, deltas (n, d), and the decrease of the cost that it predicts [nat]."""
        deltas, predicted = np.zeros((len(self.poses), self.model.n_dofs)), 0.0
        for stretch, joining in zip(self.stretches, self._joining, strict=True):
            evidence = self.evidence[stretch.rows]
            own = np.array([each.information for each in evidence]) + _DAMPING * np.eye(self.model.n_dofs)
            equations = BandedEquations.of(own, np.array([each.gradient for each in evidence]), *joining)
            deltas[stretch.rows] = x = equations.solve()
            predicted += 0.5 * float(np.sum(equations.right * x))
        return deltas, predicted

    def step(self, share: float) -> tuple[Sequence[Pose], float]:
        """Return the poses after a share of the step, and the decrease that the whole one predicts."""
        (deltas, predicted), moved = self._step, list(self.poses)
        for stretch in self.stretches:
            pairs = zip(self.poses[stretch.rows], deltas[stretch.rows], strict=True)
            moved[stretch.rows] = [move_pose(pose, share * x) for pose, x in pairs]
        return moved, predicted


def acceleration_rows(model: BodyModel, poses: Sequence[Pose], time_s: Array, gravity_m_s2: Array) -> JoiningRows:
    """Return the second derivatives of the poses (n,), less gravity (3,): in sds, each group of three by itself.

    To first order a change of the later of two poses changes the delta between them as much; a change of the earlier
    one, seen from the later, by minus as much, turned with it.
    """
    step_s, n_groups = np.diff(time_s), model.n_dofs // 3  # of the root's position, its rotation, each joint's
    rate, turn = np.zeros((len(step_s), n_groups, 3)), np.zeros((len(step_s), n_groups, 3, 3))
    for i, dt_s in enumerate(step_s):
        delta = delta_between(poses[i], poses[i + 1]).reshape(n_groups, 3)
        turned = delta * np.where(np.arange(n_groups) == 1, 1, -1)[:, None]  # a joint's axes turn with its segment
        turned[0] = 0
        rate[i], turn[i] = delta / dt_s, Rotation.from_rotvec(turned).as_matrix()
    between_s = (step_s[1:] + step_s[:-1])[:, None] / 2
    before, after = between_s * step_s[:-1, None], between_s * step_s[1:, None]
    rows = np.zeros((len(between_s), n_groups, 3, 3, 3))
    rows[:, :, :, 0] = turn[:-1] / before[..., None, None]
    rows[:, :, :, 1] = -turn[1:] / after[..., None, None] - np.eye(3) / before[..., None, None]
    rows[:, :, :, 2] = np.eye(3) / after[..., None, None]
    values = np.diff(rate, axis=0) / between_s[..., None]
    values[:, 0] -= gravity_m_s2
    is_trunk = [False] * 2 + [segment.name in TRUNK for segment in model.segments[1:]]
    is_slow = [True] * 2 + [segment.name in _SLOW for segment in model.segments[1:]]
    density = np.where(is_trunk, _TRUNK_DENSITY, np.where(is_slow, _SLOW_DENSITY, _DENSITY))
    sd = np.sqrt(density / between_s)
    return JoiningRows(rows / sd[..., None, None, None], values / sd[..., None])
