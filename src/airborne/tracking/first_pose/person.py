"""A person as the search sees one: many poses at once, and what stands out around a place, to score them by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose, PosedBody, SurfaceArrays, surface_of_segments
from airborne.cameras import Camera
from airborne.rendering import EvidenceMaps, evidence_maps, mask_evidence
from airborne.tracking.first_pose.moments import Moment
from airborne.tracking.first_pose.rigid_search import roots_of
from airborne.tracking.model_based.degrees_of_freedom import limbs_of
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Array32

THREADS = 2  # the result is the same for any number
_ROOM = 1.3  # half of the window around a place, in halves of the body's length


@dataclass(frozen=True, slots=True, eq=False)
class PoseSet:
    """Many poses of one body."""

    R: Array  # (n, 3, 3) world from root
    t: Array  # (n, 3) [m]
    angles: Array  # (n, joints, 3) [rad]

    def __len__(self) -> int:
        return len(self.R)

    def __getitem__(self, rows: NDArray[np.integer] | slice) -> PoseSet:
        return PoseSet(self.R[rows], self.t[rows], self.angles[rows])

    @classmethod
    def of(cls, poses: Sequence[Pose]) -> PoseSet:
        """Stack poses."""
        return cls(*roots_of(poses), np.stack([pose.joint_angles for pose in poses]))

    @classmethod
    def join(cls, *poses: PoseSet) -> PoseSet:
        """Put one after the other."""
        return cls(*(np.concatenate([getattr(each, name) for each in poses]) for name in ("R", "t", "angles")))

    def each(self) -> list[Pose]:
        """Return the single poses."""
        return [
            Pose(world_from_root=RigidTransform.from_components(t, Rotation.from_matrix(R)), joint_angles=angles)
            for R, t, angles in zip(self.R, self.t, self.angles, strict=True)
        ]


@dataclass(frozen=True, eq=False)
class Limb:
    """An arm or a leg, and the body without it."""

    segments: NDArray[np.int64]
    alone: SurfaceArrays
    rest: SurfaceArrays


@dataclass(frozen=True, eq=False)
class JointedBody:
    """A body with joints."""

    render_model: RenderModel

    @property
    def model(self) -> BodyModel:
        """The body."""
        return self.render_model.model

    @cached_property
    def radius_m(self) -> float:
        """Half of its length with straight joints, between the outermost joints."""
        upright = PoseSet(np.eye(3)[None], np.zeros((1, 3)), np.zeros((1, self.model.n_joints, 3)))
        return float(np.ptp(self.segments(upright)[1], axis=1).max() / 2)

    @cached_property
    def limbs(self) -> list[Limb]:
        """Arms and legs."""
        surface, found = self.render_model.geometry, []
        for segments in limbs_of(self.model):
            is_own = np.isin(np.arange(len(self.model.segments)), segments)
            found.append(Limb(segments, surface_of_segments(surface, is_own), surface_of_segments(surface, ~is_own)))
        return found

    @cached_property
    def trunk(self) -> list[int]:
        """Landmarks of the trunk and the head."""
        moved = {int(segment) for limb in self.limbs for segment in limb.segments[1:]}
        own = [self.model.index_of(each.segment) for each in self.model.landmarks]
        return [i for i, segment in enumerate(own) if segment not in moved]

    def segments(self, poses: PoseSet) -> tuple[Array, Array]:
        """Return all segments' rotations (n, s, 3, 3) and origins (n, s, 3) [m]."""
        return self.model.pose_segments(poses.R, poses.t, poses.angles)

    def landmarks(self, poses: PoseSet) -> Array:
        """Return where the landmarks are: (n, landmarks, 3) [m]."""
        R, t = self.segments(poses)
        own = [self.model.index_of(each.segment) for each in self.model.landmarks]
        local = np.array([each.position_m for each in self.model.landmarks])
        return np.einsum("nkij,kj->nki", R[:, own], local) + t[:, own]

    def middles(self, poses: PoseSet) -> Array:
        """Return the middles of the ellipsoids' surfaces, by area: (n, 3) [m]."""
        geometry, (R, t) = self.render_model.geometry, self.segments(poses)
        own = geometry.ellipsoid_segment
        if not len(own):  # a body of meshes
            return self.landmarks(poses).mean(axis=1)
        centres = np.einsum("nsij,sj->nsi", R[:, own], geometry.ellipsoid_centre) + t[:, own]
        a, b, c = geometry.ellipsoid_semi_axes.T
        return np.average(centres, axis=1, weights=a * b + b * c + a * c)

    def bodies(self, poses: PoseSet) -> list[PosedBody]:
        """Pose the body."""
        return [PosedBody(self.model, R, t) for R, t in zip(*self.segments(poses), strict=True)]


@dataclass(frozen=True, eq=False)
class SilhouetteEvidence:
    """What stands out around a place, in the views that show it."""

    cameras: Sequence[Camera]
    planes: Sequence[Array32]  # (h, w) [nats]
    images: Sequence[NDArray[np.uint8]]  # (h, w, 3)

    @classmethod
    def around(
        cls, person: JointedBody, moment: Moment, at: Array, *, scale: int = 1, blur_m: float = 0.0
    ) -> SilhouetteEvidence:
        """Blur and reduce the evidence of a moment around a place (3,)."""
        cameras, planes, images = [], [], []
        for view, nats in zip(moment.frames.views, moment.evidence, strict=True):
            if view is None or nats is None:
                continue
            window = _window(view.camera, at, _ROOM * person.radius_m)
            if window is None:
                continue
            x0, y0, x1, y1 = window
            plane = nats
            if blur_m:
                sigma = blur_m * _px_per_m(view.camera, at)
                plane = cv2.GaussianBlur(nats, (0, 0), max(sigma[0], 0.3), sigmaY=max(sigma[1], 0.3))
            size = (x1 - x0) // scale, (y1 - y0) // scale
            inside = np.s_[y0 : y0 + scale * size[1], x0 : x0 + scale * size[0]]
            planes.append(np.asarray(cv2.resize(plane[inside], size, interpolation=cv2.INTER_AREA), np.float32))
            images.append(np.asarray(cv2.resize(view.rgb[inside], size, interpolation=cv2.INTER_AREA), np.uint8))
            corner = (x0 + (scale - 1) / 2, y0 + (scale - 1) / 2)
            cameras.append(view.camera.resample(scale=(scale, scale), offset=corner, size=size))
        return cls(cameras, planes, images)

    @cached_property
    def maps(self) -> EvidenceMaps:
        """The same for `mask_evidence`."""
        return evidence_maps(self.cameras, self.planes)

    @cached_property
    def standing_out(self) -> EvidenceMaps:
        """One where a pixel stands out, for `mask_evidence`."""
        return evidence_maps(self.cameras, [(plane > 0).astype(np.float32) for plane in self.planes])

    @cached_property
    def ones(self) -> EvidenceMaps:
        """Ones, for `mask_evidence`: what a mask covers."""
        return evidence_maps(self.cameras, [np.ones_like(plane) for plane in self.planes])

    @cached_property
    def total(self) -> float:
        """The sum of all positive evidence."""
        return float(sum(np.maximum(plane, 0).sum() for plane in self.planes))

    def shares(self, person: JointedBody, poses: PoseSet) -> Array:
        """Return the share of the evidence that each pose's mask covers: (n,)."""
        segments = person.segments(poses)
        scores = mask_evidence(person.render_model.geometry, self.maps, *segments, threads=THREADS)
        return scores.sum(axis=1) / max(self.total, 1e-9)


def apart(points: Array, scores: Array, n: int, least_m: float) -> NDArray[np.int64]:
    """Return the n best of some poses that are apart, by the mean of their points (poses, k, 3), the best first."""
    chosen: list[int] = []
    for i in np.argsort(-scores, kind="stable"):
        if not chosen or np.linalg.norm(points[chosen] - points[i], axis=2).mean(axis=1).min() > least_m:
            chosen.append(int(i))
            if len(chosen) == n:
                break
    return np.array(chosen)


def _px_per_m(camera: Camera, at: Array) -> Array:
    depth_m = max(float(camera.camera_from_world.apply(at)[2]), 0.1)
    return np.array([camera.K[0, 0], camera.K[1, 1]]) / depth_m


def _window(camera: Camera, at: Array, room_m: float) -> tuple[int, int, int, int] | None:
    """Return the part of an image (x0, y0, x1, y1) that shows a place and room around it; None where there is none."""
    centre, room = camera.px_from_world(at), room_m * _px_per_m(camera, at)
    if not np.isfinite(centre).all():
        return None
    low = np.clip(np.floor(centre - room), 0, camera.size).astype(int)
    high = np.clip(np.ceil(centre + room), 0, camera.size).astype(int)
    return (low[0], low[1], high[0], high[1]) if np.all(high - low >= 16) else None
