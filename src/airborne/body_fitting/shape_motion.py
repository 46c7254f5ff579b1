"""How the points of a posed body move with its shape and its pose: affine motions of the segments, and of landmarks.

Whatever the parameter, the surface of a segment moves by c + A (x - o), with o the root's origin, and the border of its
colours along an axis besides. An affine motion is c (3,), then A (3, 3) row by row, then the border's motion [m].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airborne.body import BodyModel, PosedBody
from airborne.body.chain import point_jacobian, segment_jacobians
from airborne.body.outfits import extent_m
from airborne.body.shaping import length_axis
from airborne.body_fitting.shape import ShapeParameter, segments_of
from airborne.types import Array

N_AFFINE = 13  # numbers of a motion
_SKEW = -np.array([[[int((i - j) * (j - k) * (k - i) / 2) for k in range(3)] for j in range(3)] for i in range(3)])


@dataclass(frozen=True, slots=True, eq=False)
class ShapeMotion:
    """How k parameters move a body of s segments and m landmarks, in the segments' own frames."""

    model: BodyModel
    scale: Array  # (k, s, 3) of the surface along the segment's axes
    shift: Array  # (k, s, 3) of the surface [m]
    joint: Array  # (k, s, 3) of each segment's joint, in its parent's frame [m]
    landmark: Array  # (k, m, 3) [m]
    border: Array  # (k, s) along `axis` [m]
    axis: Array  # (s, 3) that each segment's border moves along; 0 where there is none

    @classmethod
    def of(cls, model: BodyModel, parameters: Sequence[ShapeParameter]) -> ShapeMotion:
        """Differentiate the body of a shape by the shape."""
        k, s, m = len(parameters), len(model.segments), len(model.landmarks)
        motion = cls(
            model,
            *(np.zeros((k, s, 3)) for _ in range(3)),
            landmark=np.zeros((k, m, 3)),
            border=np.zeros((k, s)),
            axis=np.zeros((s, 3)),
        )
        for index, parameter in enumerate(parameters):
            for name in segments_of(model, parameter.stem):
                motion._add(index, parameter, name)
        return motion

    def _add(self, index: int, parameter: ShapeParameter, name: str) -> None:
        """Add what one parameter does to one segment."""
        model, segment, along = self.model, self.model.index_of(name), length_axis(self.model, name)
        if parameter.border is not None:
            axis = along if parameter.border.axis is None else parameter.border.axis
            start, end = extent_m(model, name, axis)
            self.border[index, segment] = end - start
            self.axis[segment, axis] = 1
            return
        if parameter.kind == "width":
            for child, each in enumerate(model.segments):
                if each.parent == name and each.name.endswith(("_left", "_right")):
                    self.joint[index, child] = each.joint_m * [1, 0, 0]
            return
        on_axis = np.arange(3) == along
        if parameter.kind == "length":
            self.scale[index, segment] = on_axis
            for child, each in enumerate(model.segments):
                if each.parent == name:
                    self.joint[index, child] = each.joint_m * on_axis
            for mark, landmark in enumerate(model.landmarks):
                if landmark.segment == name:
                    self.landmark[index, mark] = landmark.position_m * on_axis
            return
        across = np.flatnonzero(~on_axis)
        chosen = np.isin(np.arange(3), across if parameter.axis is None else across[parameter.axis])
        self.scale[index, segment] = chosen
        centre_m = model.segments[segment].parts[0].segment_from_part.translation
        self.shift[index, segment] = -centre_m * chosen

    def joints(self, posed: PosedBody) -> Array:
        """Return how the segments' joints move: (k, s, 3) world [m]."""
        moved = np.zeros_like(self.joint)
        for segment, parent in enumerate(self.model.parents[1:], start=1):
            moved[:, segment] = moved[:, parent] + self.joint[:, segment] @ posed.R[parent].T
        return moved

    def surface_jacobian(self, posed: PosedBody) -> Array:
        """Return the segments' affine motions by shape and pose: (s, N_AFFINE, k + 6 + 3 joints)."""
        R, t, origin = posed.R, posed.t, posed.t[0]
        A = np.einsum("sij,ksj,slj->skil", R, self.scale, R)
        c = self.joints(posed).swapaxes(0, 1) + np.einsum("sij,ksj->ski", R, self.shift)
        c += np.einsum("skij,sj->ski", A, origin - t)
        by_shape = np.concatenate([c, A.reshape(*A.shape[:2], 9), self.border.T[..., None]], axis=-1)
        twists = segment_jacobians(posed, origin)
        turns = np.einsum("sad,aij->sdij", twists[:, 3:], _SKEW).reshape(len(R), -1, 9)
        by_pose = np.concatenate([twists[:, :3].swapaxes(1, 2), turns, np.zeros((*turns.shape[:2], 1))], axis=-1)
        return np.concatenate([by_shape, by_pose], axis=1).swapaxes(1, 2)

    def landmark_jacobian(self, posed: PosedBody) -> Array:
        """Return how the landmarks move by shape and pose: (m, 3, k + 6 + 3 joints)."""
        owners = self.model.landmark_segments
        by_shape = self.joints(posed)[:, owners] + np.einsum("mij,kmj->kmi", posed.R[owners], self.landmark)
        by_pose = point_jacobian(posed, owners, posed.landmarks)
        return np.concatenate([np.moveaxis(by_shape, 0, -1), by_pose], axis=-1)
