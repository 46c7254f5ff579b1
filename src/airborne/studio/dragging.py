"""A body moved by hand: a point of it is held in one camera's picture, and what carries the point follows.

A limb is held at any of its segments: its joints follow, up to the trunk. The trunk carries the whole body along. What
one camera does not show, how far away the point is, stays as it was; points held in other cameras before tell it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, PosedBody
from airborne.body.chain import clamp_to_limits, delta_between, move_pose, point_jacobian
from airborne.cameras import Camera
from airborne.export.views import cached_surface_arrays
from airborne.geometry.descent import MarquardtRule, descend
from airborne.rendering import FLAT, render
from airborne.types import Array

_POINTER_SD_PX = 1.0  # of where a point is held
_FREE_SD = 1.0  # [m, rad] of what follows, about the pose in which it was taken: what pixels leave open stays
_RULE = MarquardtRule(first=1e-4, down=5, up=4, least=1e-9, most=1e6)  # as in `body.landmark_fit`
_MOST_STEPS, _LEAST_GAIN = 12, 1e-3  # the next movement of the pointer goes on from here
_NEAR_PX = 12.0  # a point this far beside the body still takes it


@dataclass(frozen=True, slots=True, eq=False)
class Grip:
    """A point of a body that is held, and what follows it."""

    segment: int
    point_m: Array  # (3,) in the segment's frame [m]
    free: NDArray[np.int64]  # columns of a delta of the pose


@dataclass(frozen=True, slots=True, eq=False)
class Pin:
    """Where a point of the body is to be seen."""

    grip: Grip
    camera: Camera
    px: Array  # (2,) [px]


def grip_at(posed: PosedBody, camera: Camera, px: Array) -> Grip | None:
    """Take a body where a camera sees it at a pixel; None where it is not near there."""
    lens = camera.without_distortion()
    seen = render(cached_surface_arrays(posed.model), posed, lens, FLAT)
    at = camera.undistort_px(np.asarray(px, float))
    rows, columns = np.nonzero(seen.mask)
    if not len(rows):
        return None
    off_px = np.hypot(columns - at[0], rows - at[1])
    nearest = int(np.argmin(off_px))
    if off_px[nearest] > _NEAR_PX:
        return None
    row, column = rows[nearest], columns[nearest]
    depth_m = 1 / float(seen.inverse_depth[row, column])
    point = lens.camera_from_world.inv().apply(np.linalg.inv(lens.K) @ [at[0], at[1], 1.0] * depth_m)
    segment = int(seen.segment[row, column])
    return Grip(segment, posed.R[segment].T @ (point - posed.t[segment]), _columns_that_follow(posed.model, segment))


def grip_landmark(model: BodyModel, name: str) -> Grip:
    """Take a body at a landmark; at a joint, the segment that ends there."""
    landmark = next(each for each in model.landmarks if each.name == name)
    own = model.index_of(landmark.segment)
    if own and landmark.at_joint:
        parent = int(model.parents[own])
        return Grip(parent, model.joints_m[own], _columns_that_follow(model, parent))
    return Grip(own, np.asarray(landmark.position_m, float), _columns_that_follow(model, own))


def turn_with(grip: Grip) -> Grip:
    """Return the grip that turns the whole body about its root instead."""
    return Grip(grip.segment, grip.point_m, np.arange(3, 6))


def drag_pose(model: BodyModel, pose: Pose, taken: Pose, pins: Sequence[Pin]) -> Pose:
    """Return the pose that brings held points to their pixels, looked for from `pose`; what moves is the last one's.

    `taken` is the pose in which the body was taken, to which it stays as near as it can.
    """

    def evaluate(pose: Pose) -> _Iterate:
        return _Iterate(model, pose, taken, tuple(pins))

    return descend(evaluate(pose), evaluate, _RULE, most_steps=_MOST_STEPS, least_gain=_LEAST_GAIN).best.pose


def landmarks_of_grip(model: BodyModel, grip: Grip) -> list[str]:
    """Return the landmarks that follow a grip: a limb's, or those of the trunk, which carries all the others."""
    moved = {(column - 3) // 3 for column in grip.free.tolist() if column >= 6}
    if not moved:
        moved = {0, *_trunk(model)}
        return [mark.name for mark in model.landmarks if _owner(model, mark.name) in moved]
    return [mark.name for mark in model.landmarks if _owner(model, mark.name) in _with_descendants(model, moved)]


def landmarks_px(model: BodyModel, pose: Pose, camera: Camera, names: Sequence[str]) -> Mapping[str, Array]:
    """Return where a camera sees landmarks of a pose: name -> (2,) [px]; those outside its picture are left out."""
    points = model.with_pose(pose).landmarks
    seen = {mark.name: camera.px_from_world(point) for mark, point in zip(model.landmarks, points, strict=True)}
    size = np.array(camera.size)
    return {name: seen[name] for name in names if np.all((seen[name] > -0.5) & (seen[name] < size - 0.5))}


def _owner(model: BodyModel, name: str) -> int:
    return grip_landmark(model, name).segment


def _columns_that_follow(model: BodyModel, segment: int) -> NDArray[np.int64]:
    """Return the joints from a limb's segment up to the trunk; the root's place for the trunk's own segments."""
    limb = []
    while segment and segment not in _trunk(model):
        limb.append(segment)
        segment = int(model.parents[segment])
    columns = [3 + 3 * each + axis for each in sorted(limb) for axis in range(3)]
    return np.array(columns or range(3), np.int64)


def _trunk(model: BodyModel) -> set[int]:
    """Return the segments that carry more than one limb, and those between them."""
    parents = model.parents.tolist()
    trunk = {each for each in range(len(parents)) if parents.count(each) > 1}
    for each in list(trunk):
        while each > 0:
            each = parents[each]
            trunk.add(each)
    return trunk


def _with_descendants(model: BodyModel, segments: set[int]) -> set[int]:
    found = set(segments)
    for index, parent in enumerate(model.parents.tolist()):
        if parent in found:
            found.add(index)
    return found


@dataclass(frozen=True, eq=False)
class _Iterate:
    """A pose in the descent."""

    model: BodyModel
    pose: Pose
    taken: Pose
    pins: tuple[Pin, ...]

    @cached_property
    def equations(self) -> tuple[float, Array, Array]:
        """Half the squared residuals, their gradient and Gauss-Newton Hessian, of what may move."""
        free = self.pins[-1].grip.free
        posed = self.model.with_pose(self.pose)
        away = delta_between(self.taken, self.pose)[free] / _FREE_SD
        cost, gradient, hessian = away @ away, away / _FREE_SD, np.eye(len(free)) / _FREE_SD**2
        for pin in self.pins:
            own = pin.grip.segment
            point = posed.R[own] @ pin.grip.point_m + posed.t[own]
            P = pin.camera.P
            h = P[:, :3] @ point + P[:, 3]
            if h[2] <= 0:  # behind the camera
                return np.inf, gradient, hessian
            px = h[:2] / h[2]
            r = (px - pin.camera.undistort_px(pin.px)) / _POINTER_SD_PX
            J = (P[:2, :3] - px[:, None] * P[2:, :3]) / h[2] @ point_jacobian(posed, own, point)[:, free]
            cost, gradient, hessian = cost + r @ r, gradient + J.T @ r, hessian + J.T @ J
        return float(cost) / 2, gradient, hessian

    def cost(self, reference: _Iterate) -> float:
        """Return the cost."""
        return self.equations[0]

    def step(self, damping: float) -> tuple[Pose, float]:
        """Return the pose after a damped step; no decrease is predicted, as it may reach limits."""
        _, gradient, hessian = self.equations
        delta = np.zeros(self.model.n_dofs)
        delta[self.pins[-1].grip.free] = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
        return clamp_to_limits(self.model, move_pose(self.pose, delta)), np.inf
