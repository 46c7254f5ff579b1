"""The degrees of freedom that a fit may change, their prior, and one step of the fit.

A delta is a vector (6 + 3 joints,), a small change of pose, see `body.chain`. The normal equations of the segments are
mapped through the chain: H = sum J' A J, so that the pixels cost the same for 6 degrees of freedom as for 57.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import angles_of, delta_between, move_pose, segment_jacobians, separation_rows
from airborne.body.contact import contact_model, overlaps
from airborne.body.sides import without_side
from airborne.geometry.joint_rotations import rotations_of
from airborne.geometry.swing_twist import swing_twist_from_matrix, swing_twist_jacobian
from airborne.tracking.evidence import PoseEvidence
from airborne.types import Array

_LIMIT_SD_RAD = np.radians(3.0)  # sd of how far a joint may go beyond its limits
_OVERLAP_SD_M = 0.01  # sd of how far segments may pass through each other, beyond what flesh gives way
_LIMIT_ROUNDS = 3  # of finding which limits a step reaches
_BEYOND_RAD = 1e-6  # rounding
WIDE_SD = 1.5  # [m, rad]
FIRST_POSE_SD = (0.1, 0.3, 0.5)  # of a first pose set by hand: root's position [m], its rotation, joints [rad]
_DAMPING_SD_M, _DAMPING_SD_RAD = 0.5, 1.0  # hold what the images do not show


@dataclass(frozen=True, slots=True, eq=False)
class PosePrior:
    """A Gaussian about an expected pose, and evidence; limited joints also have half their range as sd about zero."""

    expected: Pose
    sd: Array  # (6 + 3 joints,) [m, rad]
    evidence: PoseEvidence | None = None

    def widen(self, columns: NDArray[np.integer]) -> PosePrior:
        """Return the prior with a wide sd for some degrees of freedom."""
        sd = self.sd.copy()
        sd[columns] = WIDE_SD
        return replace(self, sd=sd)

    def loosen(self) -> PosePrior:
        """Return the prior with sds as of a first pose, where they are smaller."""
        return replace(self, sd=np.maximum(self.sd, np.repeat(FIRST_POSE_SD, [3, 3, len(self.sd) - 6])))


@dataclass(frozen=True, slots=True, eq=False)
class DegreesOfFreedom:
    """The degrees of freedom that a fit may change."""

    model: BodyModel
    columns: NDArray[np.int64]  # (d,) indices into a delta, those of the root first

    @property
    def moves_joints(self) -> bool:
        """Whether any joint may move, not the root alone."""
        return bool(self.columns[-1] >= 6)

    @property
    def _damping(self) -> Array:
        """Inverse variances (d,) of a step, that hold what the images do not show."""
        return 1 / np.where(self.columns < 3, _DAMPING_SD_M, _DAMPING_SD_RAD) ** 2

    def jacobian(self, posed: PosedBody, origin: Array) -> Array:
        """Return how the segments move, about `origin`, with these degrees of freedom: (segments, 6, d)."""
        return segment_jacobians(posed, origin)[..., self.columns]

    def embed(self, delta: Array) -> Array:
        """Return a delta (d,) as a whole one (6 + 3 joints,), which is zero elsewhere."""
        full = np.zeros(self.model.n_dofs)
        full[self.columns] = delta
        return full

    def update(self, pose: Pose, delta: Array) -> Pose:
        """Move a pose by a delta (d,) [m, rad]."""
        return move_pose(pose, self.embed(delta))

    def solve_step(self, pose: Pose, H: Array, g: Array, prior: PosePrior | None = None) -> Array:
        """Return the delta (d,) that solves H delta = g with the prior and the joints' limits, which are soft.

        H (d, d), g (d,) in units of the noise's variance.
        """
        if not self.moves_joints and prior is None:
            return np.asarray(np.linalg.solve(H + np.diag(self._damping), g), float)
        of_prior = linearise_prior(self, pose, prior)
        H, g = H + np.diag(self._damping) + of_prior.H, g + of_prior.g
        delta = np.asarray(np.linalg.solve(H, g), float)
        for _ in range(_LIMIT_ROUNDS):
            rows, targets = self._walls(pose, delta)
            if not len(rows):
                return delta
            delta = np.asarray(np.linalg.solve(H + rows.T @ rows, g + rows.T @ targets), float)
        return delta

    def prior_cost(self, pose: Pose, prior: PosePrior | None) -> float:
        """Return minus the log prior: half the squared distances, in sds, beyond the possible and to the expected."""
        return linearise_prior(self, pose, prior).cost if self.moves_joints or prior is not None else 0.0

    def rest_residuals(self, pose: Pose) -> tuple[Array, Array]:
        """Return how far limited joints are from the zero pose, in half ranges: rows (k, d), values (k,)."""
        joints, rest = _joint_places(self.model, pose), _rest(self.model)
        rows = np.zeros((len(rest.joints), self.model.n_dofs))
        jacobian = swing_twist_jacobian(joints.relative)[rest.joints, rest.axes]
        rows[np.arange(len(rest.joints))[:, None], rest.columns] = jacobian / rest.sd_rad[:, None]
        away = joints.coordinates[rest.joints, rest.axes] - rest.straight
        return rows[:, self.columns], away / rest.sd_rad

    def _overlap_residuals(self, pose: Pose) -> tuple[Array, Array]:
        """Return how deep segments pass through each other, in sds: rows (k, d), values (k,)."""
        root, joints = pose.world_from_root.as_matrix()[None], angles_of(pose, self.model.n_joints)
        R, t = self.model.pose_segments(root[:, :3, :3], root[:, :3, 3], joints[None])
        found = overlaps(contact_model(self.model), R[0], t[0])
        if not len(found.depth_m):
            return np.zeros((0, len(self.columns))), np.zeros(0)
        posed = PosedBody(self.model, R[0], t[0])
        rows = -separation_rows(posed, found.segments, found.point, found.normal)
        return rows[:, self.columns] / _OVERLAP_SD_M, found.depth_m / _OVERLAP_SD_M

    def _walls(self, pose: Pose, delta: Array) -> tuple[Array, Array]:
        """Return rows (k, d) and targets (k,), in sds, of the joints that the delta would take past a limit."""
        limits = self.model.limits
        if not self.moves_joints or not limits.is_limited.any():
            return np.zeros((0, len(self.columns))), np.zeros(0)
        angles = angles_of(pose, self.model.n_joints)
        after, bound = limits.move(angles, self.embed(delta)[6:].reshape(-1, 3))
        beyond = np.sqrt(np.square(after - bound).sum(axis=1))
        joints = np.flatnonzero(beyond > _BEYOND_RAD)
        if not len(joints):
            return np.zeros((0, len(self.columns))), np.zeros(0)
        normal = (after - bound)[joints] / beyond[joints, None]
        here = _joint_places(self.model, pose)
        rows = np.zeros((len(joints), self.model.n_dofs))
        columns = 6 + 3 * joints[:, None] + np.arange(3)
        jacobian = swing_twist_jacobian(here.relative[joints])
        rows[np.arange(len(joints))[:, None], columns] = np.einsum("ki,kij->kj", normal, jacobian)
        targets = np.einsum("ki,ki->k", normal, bound[joints] - here.coordinates[joints])
        return rows[:, self.columns] / _LIMIT_SD_RAD, targets / _LIMIT_SD_RAD


class LinearPrior(NamedTuple):
    """A prior about a pose, to second order: minus its logarithm there, and the normal equations of a step."""

    cost: float
    H: Array  # (d, d)
    g: Array  # (d,)


@lru_cache(maxsize=8)  # a descent asks for the cost of a pose, and then for the step from it
def linearise_prior(dofs: DegreesOfFreedom, pose: Pose, prior: PosePrior | None) -> LinearPrior:
    """Linearise what is possible and what a prior expects; joints' limits, which are walls, add to the cost alone."""
    d = len(dofs.columns)
    cost, residuals, precision, g = 0.0, [], np.zeros(d), np.zeros(d)
    if dofs.moves_joints:
        coordinates = _joint_places(dofs.model, pose).coordinates
        excess = (coordinates - dofs.model.limits.nearest(coordinates)).ravel() / _LIMIT_SD_RAD
        cost = 0.5 * float(excess @ excess)
        residuals.append(dofs._overlap_residuals(pose))
    if prior is not None:
        precision = 1 / prior.sd[dofs.columns] ** 2
        away = delta_between(prior.expected, pose)[dofs.columns]
        cost, g = cost + 0.5 * float(away @ (precision * away)), -precision * away
        residuals.append(dofs.rest_residuals(pose))
        if prior.evidence is not None:
            rows, values = prior.evidence.residuals(pose)
            residuals.append((rows[:, dofs.columns], values))
    H = np.diag(precision)
    for rows, values in residuals:
        if not len(values):
            continue
        cost, H, g = cost + 0.5 * float(values @ values), H + rows.T @ rows, g - rows.T @ values
    return LinearPrior(cost, H, g)


class _JointPlaces(NamedTuple):
    """Where the joints of a pose are, relative to the centres of their ranges."""

    relative: Array  # (joints, 3, 3)
    coordinates: Array  # (joints, 3) swing's x and y, twist [rad]


@lru_cache(maxsize=8)  # the prior, its step and the walls of a step ask for the same pose
def _joint_places(model: BodyModel, pose: Pose) -> _JointPlaces:
    relative = model.limits.relative(rotations_of(angles_of(pose, model.n_joints)))
    return _JointPlaces(relative, swing_twist_from_matrix(relative))


class _Rest(NamedTuple):
    """The limited coordinates of a body's joints in the zero pose, k of them."""

    joints: NDArray[np.int64]  # (k,)
    axes: NDArray[np.int64]  # (k,) 0, 1: the swing, 2: the twist
    columns: NDArray[np.int64]  # (k, 3) of the joint in a delta
    sd_rad: Array  # (k,) half the range
    straight: Array  # (k,) [rad] within the limits


@lru_cache(maxsize=16)
def _rest(model: BodyModel) -> _Rest:
    limits = model.limits
    joints, axes = np.nonzero(np.isfinite(limits.half_rad) & (limits.half_rad > 0))
    straight = limits.nearest(limits.coordinates(np.eye(3)))
    columns = 6 + 3 * joints[:, None] + np.arange(3)
    return _Rest(joints, axes, columns, limits.half_rad[joints, axes], straight[joints, axes])


def root_only(model: BodyModel) -> DegreesOfFreedom:
    """Free the root: the body moves in one piece."""
    return DegreesOfFreedom(model, np.arange(6))


def all_joints(model: BodyModel) -> DegreesOfFreedom:
    """Free everything."""
    return DegreesOfFreedom(model, np.arange(model.n_dofs))


def proximal_to_distal(model: BodyModel) -> list[DegreesOfFreedom]:
    """Free the trunk first, then what hangs on it, then distally (paper B, "Discussion"): one set a stage."""
    distance = _distance_from_trunk(model)
    columns = np.arange(model.n_dofs)
    of_segment = np.concatenate([np.zeros(6, int), np.arange(1, len(model.segments)).repeat(3)])
    return [DegreesOfFreedom(model, columns[distance[of_segment] <= stage]) for stage in range(distance.max() + 1)]


@lru_cache(maxsize=16)
def limb_of_segment(model: BodyModel) -> NDArray[np.int64]:
    """Return for each segment the first segment of its limb, -1 for those of the trunk: (segments,)."""
    distance, limb = _distance_from_trunk(model), np.full(len(model.segments), -1)
    for segment in np.flatnonzero(distance > 0):
        limb[segment] = segment if distance[segment] == 1 else limb[model.parents[segment]]
    limb.flags.writeable = False
    return limb


@lru_cache(maxsize=16)
def limbs_of(model: BodyModel) -> tuple[NDArray[np.int64], ...]:
    """Return the segments of each limb of more than one segment."""
    limb = limb_of_segment(model)
    limbs = [np.flatnonzero(limb == each) for each in np.unique(limb[limb >= 0])]
    return tuple(each for each in limbs if len(each) > 1)


@lru_cache(maxsize=16)
def pair_of_segment(model: BodyModel) -> NDArray[np.int64]:
    """Return the number of each segment's pair of limbs, arms or legs, -1 for those of none: (segments,)."""
    pairs, names = np.full(len(model.segments), -1), dict[str, int]()
    for limb in limbs_of(model):
        pairs[limb] = names.setdefault(without_side(model.segments[limb[0]].name), len(names))
    pairs.flags.writeable = False
    return pairs


def joints_of(model: BodyModel, segments: NDArray[np.integer]) -> DegreesOfFreedom:
    """Free the joints of some segments."""
    return DegreesOfFreedom(model, (3 + 3 * np.asarray(segments)[:, None] + np.arange(3)).ravel())


def _distance_from_trunk(model: BodyModel) -> NDArray[np.int64]:
    """Count the joints from each segment to the trunk, the segments that several chains hang on: (segments,)."""
    parents = model.parents
    is_trunk = np.bincount(parents[1:], minlength=len(parents)) > 1
    is_trunk[0] = True
    for segment in range(len(parents) - 1, 0, -1):
        if is_trunk[segment]:
            is_trunk[parents[segment]] = True
    distance = np.zeros(len(parents), int)
    for segment in range(1, len(parents)):
        distance[segment] = 0 if is_trunk[segment] else distance[parents[segment]] + 1
    return distance
