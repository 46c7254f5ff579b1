"""The estimate of a body's pose at one time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.types import Array


class Status(StrEnum):
    """How far an estimate can be trusted."""

    TRACKED = "tracked"
    UNCERTAIN = "uncertain"
    LOST = "lost"  # no estimate: the pose is None


class Doubt(StrEnum):
    """Why an estimate is uncertain."""

    IMAGES = "images"  # they agree less with the pose than in the frames before
    POSITION = "position"  # its standard deviation is too large
    VIEW = "view"  # much of the body is out of the pictures
    LIMBS = "limbs"  # some may be misplaced, and nothing of this recording was learned before
    DIRECTIONS = "directions"  # forward and back in time the body was found in different places
    SELF_CHECK = "self-check"


def worst_status(statuses: Iterable[Status]) -> Status:
    """Return the one that can be trusted least."""
    return max(statuses, key=list(Status).index)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimate:
    """The pose at one time, with its uncertainty.

    The covariance (6 + 3 joints, 6 + 3 joints) is over the root's position [m], a rotation vector in world axes [rad],
    and for the joint of every segment after the root a rotation vector in that segment's own axes [rad]: the numbers of
    `airborne.body.chain.move_pose`. (6, 6) of a body with joints says nothing of them. A direction that the images do
    not show has an infinite variance.
    """

    index: int
    time_s: Fraction
    status: Status
    score: float  # RMS colour difference inside the mask [grey levels]; NaN when lost
    pose: Pose | None
    covariance: Array | None
    n_views: int  # cameras with an image that shows the body
    doubts: tuple[Doubt, ...] = ()  # why it is uncertain; of a tracked or lost one none
    mask_shares: tuple[float, float] | None = None  # precision and recall of its mask, by what was learned before
    uncertain_joints: tuple[int, ...] = ()  # those, from 0, that may be elsewhere, whatever the covariance says


def with_doubt(estimate: Estimate, doubt: Doubt) -> Estimate:
    """Return an estimate as uncertain, for one reason more; one that is lost stays so."""
    if estimate.status is Status.LOST:
        return estimate
    doubts = (*(each for each in estimate.doubts if each != doubt), doubt)
    return replace(estimate, status=Status.UNCERTAIN, doubts=doubts)


def lost_estimate(index: int, time_s: Fraction) -> Estimate:
    """Return the estimate of a frame in which the body was not found."""
    return Estimate(index=index, time_s=time_s, status=Status.LOST, score=np.nan, pose=None, covariance=None, n_views=0)


def has_unknown_limb(estimate: Estimate, model: BodyModel) -> bool:
    """Say whether the images do not show some joint of the body."""
    covariance = estimate.covariance
    return covariance is not None and len(covariance) == model.n_dofs and bool(np.isinf(covariance[6:, 6:]).any())
