"""The estimate of a player from a fit: covariances, and how far each joint can be trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airborne.tracking.capsules.dynamics import N_FREE
from airborne.tracking.capsules.equations import N_LENGTHS, N_POINTS
from airborne.tracking.capsules.first_frame import points_of
from airborne.tracking.capsules.fit import JumperFit
from airborne.tracking.capsules.jumper import N_DOF, PELVIS
from airborne.tracking.capsules.track import Track, evidence_per_px
from airborne.tracking.capsules.unseen_legs import covariance_of_unseen, find_unseen_legs
from airborne.tracking.estimate import Status, worst_status
from airborne.tracking.players import PlayerEstimate
from airborne.types import Array
from airborne.video import Frames

# chosen by hand on synthetic blocks: blocker_variants.csv, and hidden_legs.csv for what is called tracked
_LEAST_SHARE = 0.5  # of the reference evidence per pixel
UNCERTAIN_SD_M = 0.06  # RMS over the axes, above which a joint is uncertain
SHAPE = np.arange(N_DOF + PELVIS, N_DOF + N_LENGTHS)  # the constant lengths in a state
_STEP_M = 1e-4  # of the finite differences


def estimate_player(name: str, frames: Frames, track: Track, *, fitted: JumperFit, n_views: int) -> PlayerEstimate:
    """Return the estimate of a player's fit, in which `n_views` cameras show the player.

    A joint is tracked where two cameras show the player as well as usual, its sd is small, and its leg's own pixels
    show the leg.
    """
    jacobian = fitted.jacobian.reshape(N_POINTS, 3, -1)
    state_covariance = track.filtered.covariance[:N_FREE, :N_FREE] + fitted.model_error_covariance
    covariance = jacobian @ state_covariance @ jacobian.swapaxes(1, 2)
    length_jacobian = _length_jacobian(fitted.state)
    covariance += length_jacobian @ track.shape_covariance @ length_jacobian.swapaxes(1, 2)
    covariance += covariance_of_unseen(fitted, track.reference_evidence)
    score = evidence_per_px(fitted.owned)
    is_seen = n_views >= 2 and score >= _LEAST_SHARE * track.reference_evidence
    is_tracked = is_seen & (_sd(covariance) < UNCERTAIN_SD_M)
    for leg in find_unseen_legs(fitted.owned, track.reference_evidence):
        is_tracked[[2 + leg, 4 + leg, 6 + leg]] = False  # knee, ankle and foot
    return PlayerEstimate(
        player=name,
        index=frames.index,
        time_s=frames.time_s,
        joint_status=tuple(Status.TRACKED if each else Status.UNCERTAIN for each in is_tracked),
        points=fitted.points,
        covariance=covariance,
        score=score,
        n_views=n_views,
    )


def widen_estimate(estimate: PlayerEstimate, covariance: Array) -> PlayerEstimate:
    """Add covariances (9, 3, 3) [m²] to those of an estimate's points; whose sd is large then is not tracked."""
    widened = estimate.covariance + covariance
    is_wide = _sd(widened) >= UNCERTAIN_SD_M
    status = (
        worst_status([each, Status.UNCERTAIN]) if wide else each
        for each, wide in zip(estimate.joint_status, is_wide, strict=True)
    )
    return replace(estimate, covariance=widened, joint_status=tuple(status))


def _sd(covariance: Array) -> Array:
    """Return the sds of points, RMS over the axes."""
    return np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 3)


def _length_jacobian(state: Array) -> Array:
    """Return the points' Jacobian by the constant lengths: (9, 3, 5)."""
    points = points_of(state)
    shifted = np.tile(state, (len(SHAPE), 1))
    shifted[np.arange(len(SHAPE)), SHAPE] += _STEP_M
    return np.stack([(points_of(each) - points) / _STEP_M for each in shifted], axis=-1)
