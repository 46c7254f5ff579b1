"""Search for a thing: all orientations at the places where something moves, scored by silhouettes, the best fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.special import ndtri

from airborne.body import BodyModel, Pose, SurfaceArrays
from airborne.body.symmetry import continuous_axes, symmetries
from airborne.geometry.rotations import super_fibonacci
from airborne.geometry.sampling import sobol_points
from airborne.rendering import FLAT, EvidenceMaps, ScoreRule, evidence_maps, mask_evidence, pack_targets, score
from airborne.tracking.first_pose.moments import Moment, crop_probability
from airborne.tracking.first_pose.places import Place
from airborne.tracking.image_regions import bounding_points
from airborne.tracking.model_based.degrees_of_freedom import root_only
from airborne.tracking.model_based.first_frame import fit_first
from airborne.tracking.model_based.fitter import Fitter
from airborne.tracking.model_based.gauss_newton import Posteriors, PyramidLevels, fit_silhouettes
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Array32

_N_ORIENTATIONS = 3000  # about 9 degrees from any orientation to the nearest
_BLURS = (0.12, 0.06, 0.03)  # of the evidence, in body radii, coarse to fine
_N_KEPT = 64  # orientations that are searched around
_N_AROUND = 32  # proposals around each, at every blur after the first
_WIDTH_M, _WIDTH_RAD = 0.12, 0.16  # sds of the first of these, in body radii and radians; halved each time
_APART_RAD = 0.35  # orientations that are closer count as one
N_FITTED = 20  # of the best, to the silhouettes
_LEVELS: PyramidLevels = ((4, 4), (2, 3), (1, 4))  # reduction of the small pictures, steps
# the next three: `benchmarks/accuracy/find_start.py`, seeds from 1000 on, none of which its rows are measured on
_SHARE_PER_NAT = 0.01  # share of the evidence that makes a silhouette e times likelier
_CHROMA_SD, _GREY_SD = 4.0, 12.0  # of colours, less their brightness, and with it [grey levels]
_MOST_GREY = 128.0  # [grey levels] a larger difference counts as this
_MARGIN_PX = 24  # around the poses, of the small pictures


@dataclass(frozen=True, eq=False)
class Thing:
    """A rigid body as the search sees it."""

    render_model: RenderModel

    @property
    def model(self) -> BodyModel:
        """The body."""
        return self.render_model.model

    @cached_property
    def centre(self) -> Array:
        """The middle of its surface, in the root's frame: (3,) [m]."""
        return _surface_centre(self.render_model.geometry)

    @cached_property
    def radius_m(self) -> float:
        """The largest distance of its surface from its centre."""
        body = self.render_model.with_pose(Pose(world_from_root=RigidTransform.identity()))
        points = bounding_points(body, self.render_model.geometry)
        return float(np.linalg.norm(points - self.centre, axis=1).max())

    @cached_property
    def symmetries(self) -> Array:
        """Rotations of the root that no picture shows: (s, 3, 3)."""
        return np.stack(symmetries(self.model))

    @cached_property
    def axes(self) -> Array:
        """Axes about which no rotation is visible: (k, 3)."""
        return continuous_axes(self.model)

    def angles(self, R: Array, other: Array) -> Array:
        """Return the angles between orientations R (n, 3, 3) and another (3, 3), up to symmetry: (n,) [rad]."""
        if len(self.axes) == 3:
            return np.zeros(len(R))
        if len(self.axes) == 1:
            directions = R @ self.axes[0], other @ self.symmetries @ self.axes[0]
            return np.arccos(np.clip(directions[0] @ directions[1].T, -1, 1)).min(axis=1)
        traces = np.einsum("nij,sij->ns", R, other @ self.symmetries)
        return np.arccos(np.clip((traces.max(axis=1) - 1) / 2, -1, 1))


def search_orientations(thing: Thing, moment: Moment, place: Place) -> list[Pose]:
    """Search all orientations at one place of one moment; return what was found, the best first, all different."""
    R = super_fibonacci(_N_ORIENTATIONS)
    t = place.position - R @ thing.centre
    for number, blur in enumerate(_BLURS):
        maps = _blur_maps(moment, place, blur * thing.radius_m)
        if number == 0:
            scores = _scores(thing, maps, R, t)
            best = _apart(thing, R, t, scores, n=_N_KEPT)
            R, t = R[best], t[best]
            continue
        steps = ndtri(sobol_points(6, _N_AROUND * _N_KEPT, seed=number)[: _N_AROUND * len(R)]) / 2 ** (number - 1)
        steps[: len(R)] = 0
        parent = np.arange(len(steps)) % len(R)
        turned = Rotation.from_rotvec(_WIDTH_RAD * steps[:, 3:]).as_matrix() @ R[parent]
        middle = (t + R @ thing.centre)[parent] + _WIDTH_M * thing.radius_m * steps[:, :3]
        moved = middle - turned @ thing.centre
        scores = _scores(thing, maps, turned, moved).reshape(_N_AROUND, len(R))
        rows = scores.argmax(axis=0) * len(R) + np.arange(len(R))
        R, t = turned[rows], moved[rows]
    poses = [
        Pose(world_from_root=RigidTransform.from_components(position, Rotation.from_matrix(rotation)))
        for rotation, position in zip(R, t, strict=True)
    ]
    return _fit(thing, moment, different_poses(thing, moment, poses, N_FITTED))


def log_likelihoods(thing: Thing, moment: Moment, poses: Sequence[Pose]) -> Array:
    """Compare poses with each other by silhouettes and known colours: (n,) [nats]."""
    R, t = roots_of(poses)
    evidence = _scores(thing, full_maps(moment, moment.evidence), R, t)
    nats = (evidence / max(evidence.max(), 1e-9) - 1) / _SHARE_PER_NAT
    if thing.model.needs_colours:
        return nats
    targets, geometry = pack_targets(moment.frames.views, FLAT), thing.render_model.geometry
    for rule, sd in ((ScoreRule(normalised=1.0), _CHROMA_SD), (ScoreRule(fits_gain=True), _GREY_SD)):
        off = score(geometry, targets, R[:, None], t[:, None], rule=rule)
        nats = nats - np.minimum(off, _MOST_GREY) ** 2 / (2 * sd**2)
    return nats


def _fit(thing: Thing, moment: Moment, poses: Sequence[Pose]) -> list[Pose]:
    """Fit poses to the silhouettes."""
    bodies = [thing.render_model.with_pose(pose) for pose in poses]
    masks = Posteriors(*crop_probability(moment, bodies, thing.render_model.geometry, _MARGIN_PX))
    dofs = root_only(thing.model)
    return [fit_silhouettes(thing.render_model, pose, masks, levels=_LEVELS, dofs=dofs) for pose in poses]


def fit_image(thing: Thing, moment: Moment, pose: Pose) -> Pose:
    """Fit a pose to the small pictures themselves, as the first frame of a run is; itself where that is no better."""
    fit = fit_first(Fitter.of(thing.render_model, "refined", fixed_shape=True), pose, moment.frames, None)
    both = [pose] if fit is None else [pose, fit.fit.pose]
    return both[int(np.argmax(log_likelihoods(thing, moment, both)))]


def different_poses(thing: Thing, moment: Moment, poses: Sequence[Pose], n: int) -> list[Pose]:
    """Return the n likeliest of the poses that are apart from each other, the likeliest first."""
    R, t = roots_of(poses)
    return [poses[i] for i in _apart(thing, R, t, log_likelihoods(thing, moment, poses), n=n)]


def roots_of(poses: Sequence[Pose]) -> tuple[Array, Array]:
    """Return the poses' rotations (n, 3, 3) and positions (n, 3) [m]."""
    roots = [pose.world_from_root for pose in poses]
    return np.stack([root.rotation.as_matrix() for root in roots]), np.stack([root.translation for root in roots])


def full_maps(moment: Moment, planes: Sequence[Array32 | None]) -> EvidenceMaps:
    """Sum planes (h, w), one a view, for `mask_evidence`; None where a view has none."""
    kept = [
        (view.camera, plane)
        for view, plane in zip(moment.frames.views, planes, strict=True)
        if view is not None and plane is not None
    ]
    return evidence_maps([camera for camera, _ in kept], [plane for _, plane in kept])


def _blur_maps(moment: Moment, place: Place, blur_m: float) -> EvidenceMaps:
    cameras, planes = [], []
    for view, nats in zip(moment.frames.views, moment.evidence, strict=True):
        if view is None or nats is None:
            continue
        depth_m = max(float(view.camera.camera_from_world.apply(place.position)[2]), 0.1)
        sigma = blur_m / depth_m * np.array([view.camera.K[0, 0], view.camera.K[1, 1]])
        cameras.append(view.camera)
        planes.append(cv2.GaussianBlur(nats, (0, 0), max(sigma[0], 0.3), sigmaY=max(sigma[1], 0.3)))
    return evidence_maps(cameras, planes)


def _scores(thing: Thing, maps: EvidenceMaps, R: Array, t: Array) -> Array:
    return mask_evidence(thing.render_model.geometry, maps, R[:, None], t[:, None]).sum(axis=1)


def _apart(thing: Thing, R: Array, t: Array, scores: Array, *, n: int) -> list[int]:
    """Return the indices of the n best poses that are apart from each other, the best first."""
    chosen: list[int] = []
    left = np.ones(len(R), bool)
    middles = t + R @ thing.centre
    for i in np.argsort(-scores, kind="stable"):
        if left[i]:
            chosen.append(int(i))
            is_near = np.linalg.norm(middles - middles[i], axis=1) < 0.3 * thing.radius_m
            left &= ~(is_near & (thing.angles(R, R[i]) < _APART_RAD))
            if len(chosen) == n:
                break
    return chosen


def _surface_centre(geometry: SurfaceArrays) -> Array:
    """Return the middle of a body's surface, by area, in its only segment's frame: (3,) [m]."""
    centres, areas = [*geometry.ellipsoid_centre], [float(a @ np.roll(a, 1)) for a in geometry.ellipsoid_semi_axes]
    areas = [4 * np.pi / 3 * area for area in areas]
    for first, last in pairwise(geometry.start):
        corners = geometry.corners[first:last]
        fan = np.cross(corners[1:-1] - corners[0], corners[2:] - corners[0])
        centres.append(corners.mean(axis=0))
        areas.append(float(np.linalg.norm(fan, axis=1).sum()) / 2)
    return np.average(centres, axis=0, weights=areas)
