"""Two passes over the same frames, forward and backward in time, joined by their covariances.

Both see the same images, so that where they agree the joined information is the mean of the two, not the sum. Where
a limb or the trunk disagrees, one of the passes has lost it: the forward pass is right up to some frame, and from
there on the backward pass. That frame is where the images are likeliest over the whole stretch of disagreement. A limb
that is in two places is as uncertain as they are apart, however sure the images seem: both may be wrong. Segments that
are far apart are uncertain by name; where the trunk is, the frame is, and nothing is learned from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from airborne.body import BodyModel, Pose
from airborne.body.chain import delta_between, joint_angles_of, move_pose
from airborne.tracking.estimate import Doubt, Estimate, Status, with_doubt
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment
from airborne.tracking.model_based.misplaced_limbs import APART_M
from airborne.tracking.unobserved import with_unobserved, without_unobserved
from airborne.types import Array

_DISAGREE_P = 1e-3  # two passes that agree differ by more than this test allows in one frame of a thousand
_STATUS_ORDER = (Status.TRACKED, Status.UNCERTAIN, Status.LOST)


@dataclass(frozen=True, slots=True, eq=False)
class PassDifference:
    """How two estimates of one time differ."""

    delta: Array  # (6 + 3 joints,) from the forward to the backward one; empty where either has no pose
    apart: tuple[int, ...]  # the parts, see `parts_of`, that disagree: beyond their covariances, or by APART_M
    is_far: NDArray[np.bool_]  # which segments have a landmark further apart than APART_M; empty as `delta`
    candidates: tuple[Pose, ...]  # the forward pose, and it with each of those parts as the backward pass has it


@dataclass(frozen=True, slots=True, eq=False)
class Passes:
    """The estimates of one time from both passes."""

    forward: Estimate
    backward: Estimate
    difference: PassDifference
    nats: Array | None  # minus the log-likelihood of the images in each candidate


def parts_of(model: BodyModel) -> list[NDArray[np.int64]]:
    """Return the columns of a delta of the trunk with the root, and of each limb."""
    limb = limb_of_segment(model)
    column = np.concatenate([np.full(6, -1), np.repeat(limb[1:], 3)])
    return [np.flatnonzero(column == each) for each in np.unique(column)]


def differences(model: BodyModel, forward: Estimate, backward: Estimate) -> PassDifference:
    """Compare two estimates part by part; where the trunks disagree, everything is one part."""
    if forward.pose is None or backward.pose is None:
        return PassDifference(np.zeros(0), (), np.zeros(0, np.bool_), ())
    delta = delta_between(forward.pose, backward.pose)
    covariance = _covariance(forward, len(delta)) + _covariance(backward, len(delta))
    parts, here, there = parts_of(model), model.with_pose(forward.pose), model.with_pose(backward.pose)
    off_m, is_far = np.linalg.norm(here.landmarks - there.landmarks, axis=-1), np.zeros(len(model.segments), np.bool_)
    is_far[model.landmark_segments[off_m > APART_M]] = True
    part_of = np.unique(limb_of_segment(model), return_inverse=True)[1]
    apart = tuple(
        k
        for k, own in enumerate(parts)
        if _is_apart(delta[own], covariance[np.ix_(own, own)]) or np.any(is_far[part_of == k])
    )
    if 0 in apart:
        return PassDifference(delta, tuple(range(len(parts))), is_far, (forward.pose, backward.pose))
    candidates = (forward.pose, *(_with_limbs(model, forward.pose, backward.pose, [k]) for k in apart)) if apart else ()
    return PassDifference(delta, apart, is_far, candidates)


def join_passes(model: BodyModel, passes: Sequence[Passes]) -> list[Estimate]:
    """Join the estimates of a stretch, in the order of time."""
    parts = parts_of(model)
    takes_backward = np.zeros((len(passes), len(parts)), bool)
    for k in range(len(parts)):
        gain = np.array([_gain_of_backward(each, k) for each in passes])
        for run in _runs(np.isfinite(gain)):
            takes_backward[_switch(gain, run), k] = True
    return [_join(model, each, takes) for each, takes in zip(passes, takes_backward, strict=True)]


def _is_apart(delta: Array, covariance: Array) -> bool:
    distance = float(delta @ np.linalg.solve(covariance, delta))
    return distance > chdtri(len(delta), _DISAGREE_P)


def _gain_of_backward(passes: Passes, part: int) -> float:
    """Return by how much the images are likelier with a part as the backward pass has it; NaN where the two agree."""
    apart, nats = passes.difference.apart, passes.nats
    if nats is None or part not in apart:
        return np.nan
    return float(nats[0] - nats[1 if 0 in apart else 1 + apart.index(part)])


def _runs(is_in: NDArray[np.bool_]) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_in, [False]]).astype(int)))
    return [slice(a, b) for a, b in edges.reshape(-1, 2).tolist()]


def _switch(gain: Array, run: slice) -> slice:
    """Return the later rows of a run, those from which on the backward pass is taken."""
    later = np.concatenate([np.cumsum(gain[run][::-1])[::-1], [0.0]])  # gained by switching at each row, or never
    return slice(run.start + int(np.argmax(later)), run.stop)


def _join(model: BodyModel, passes: Passes, takes_backward: NDArray[np.bool_]) -> Estimate:
    forward, backward, difference = passes.forward, passes.backward, passes.difference
    better = min(forward, backward, key=lambda each: _STATUS_ORDER.index(each.status))
    if forward.pose is None or backward.pose is None:
        return better
    delta, parts = difference.delta, parts_of(model)
    W = [np.linalg.inv(_covariance(each, len(delta))) for each in (forward, backward)]
    covariance = np.asarray(np.linalg.inv((W[0] + W[1]) / 2), float)
    if not difference.apart:
        pose = move_pose(forward.pose, np.asarray(np.linalg.solve(W[0] + W[1], W[1] @ delta), float))
        return replace(better, pose=pose, covariance=with_unobserved(covariance))
    if 0 in difference.apart:
        pose = backward.pose if takes_backward[0] else forward.pose
    else:
        pose = _with_limbs(model, forward.pose, backward.pose, [k for k in difference.apart if takes_backward[k]])
    for k in difference.apart:
        covariance[np.ix_(parts[k], parts[k])] += np.outer(delta[parts[k]], delta[parts[k]])
    if difference.is_far[limb_of_segment(model) < 0].any():
        better = with_doubt(better, Doubt.DIRECTIONS)
    far = tuple(np.flatnonzero(difference.is_far[1:]).tolist())
    return replace(better, pose=pose, covariance=with_unobserved(covariance), uncertain_joints=far)


def _with_limbs(model: BodyModel, pose: Pose, other: Pose, parts: Sequence[int]) -> Pose:
    """Return a pose with some limbs turned in the world as they are in another."""
    columns = np.concatenate([parts_of(model)[k] for k in parts] or [np.zeros(0, np.int64)])
    segments = np.unique(columns // 3 - 1)
    R, near = model.with_pose(pose).R.copy(), pose.joint_angles.copy()
    R[segments] = model.with_pose(other).R[segments]
    near[segments - 1] = other.joint_angles[segments - 1]
    moved = joint_angles_of(model, R, near=near)
    angles = pose.joint_angles.copy()
    angles[segments - 1] = moved[segments - 1]
    return replace(pose, joint_angles=angles)


def _covariance(estimate: Estimate, n: int) -> Array:
    """Return an estimate's covariance (n, n) with a wide variance where it is infinite or unknown."""
    return without_unobserved(np.full((n, n), np.nan) if estimate.covariance is None else estimate.covariance, n)
