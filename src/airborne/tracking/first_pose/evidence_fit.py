"""From an expected pose and evidence of any forms, however little, to the likeliest pose within the limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airborne.body import Pose
from airborne.body.inverse_kinematics import CORE, fit_pose
from airborne.errors import BodyError
from airborne.geometry.descent import BacktrackingRule, descend
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.first_pose.fit import LANDMARK_WEIGHTS
from airborne.tracking.model_based.degrees_of_freedom import DegreesOfFreedom, PosePrior, all_joints
from airborne.types import Array

_RULE = BacktrackingRule(factor=0.5, least=0.05)
_MOST_STEPS = 60  # ten from a far start are usual
_LEAST_GAIN = 1e-6  # of the cost
_EXPECTED_WEIGHT = 0.01  # of a landmark's expected place, where the evidence says nothing of it, in the first guess


def join_evidence(expected: Pose, sds: Sequence[float] | Array, evidence: PoseEvidence) -> Pose:
    """Return the likeliest pose, given an expected one with sds (6 + 3 joints,) [m, rad] and the evidence.

    It is looked for from the expected pose, and from where the landmarks of known position put every limb.
    """
    dofs, prior = all_joints(evidence.model), PosePrior(expected, np.asarray(sds, float), evidence)
    starts = [expected, *_from_positions(expected, evidence)]
    ends = [
        descend(
            _Iterate(pose, dofs, prior),
            lambda pose: _Iterate(pose, dofs, prior),
            _RULE,
            most_steps=_MOST_STEPS,
            least_gain=_LEAST_GAIN,
        ).best
        for pose in starts
    ]
    return min(ends, key=lambda end: end.value).pose


@dataclass(frozen=True, eq=False)
class _Iterate:
    """A pose in the descent."""

    pose: Pose
    dofs: DegreesOfFreedom
    prior: PosePrior

    @cached_property
    def value(self) -> float:
        return self.dofs.prior_cost(self.pose, self.prior)

    def cost(self, reference: _Iterate) -> float:
        """Return minus the log of the pose's probability."""
        return self.value

    def step(self, share: float) -> tuple[Pose, float]:
        """Return the pose after a share of the step; no decrease is predicted, as it may reach limits."""
        n = len(self.dofs.columns)
        delta = self.dofs.solve_step(self.pose, np.zeros((n, n)), np.zeros(n), self.prior)
        return self.dofs.update(self.pose, share * delta), np.inf


def _from_positions(expected: Pose, evidence: PoseEvidence) -> list[Pose]:
    """Return the pose that brings the landmarks to their known positions; none where there are none to speak of."""
    model, targets = evidence.model, evidence.positions_of_landmarks()
    if not targets:
        return []
    weights = {name: LANDMARK_WEIGHTS.get(name, 1.0) for name in targets}
    if not set(CORE) <= set(targets):
        posed = model.with_pose(expected)
        names = [landmark.name for landmark in model.landmarks]
        missing = {name: point for name, point in zip(names, posed.landmarks, strict=True) if name not in targets}
        weights |= dict.fromkeys(missing, _EXPECTED_WEIGHT)
        targets = {**targets, **missing}
    try:
        return [fit_pose(model, targets, weights=weights).pose]
    except BodyError:
        return []
