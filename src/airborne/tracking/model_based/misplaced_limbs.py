"""Misplaced limbs: detected by the pixels that they cover, searched for one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform
from scipy.special import ndtri

from airborne.appearance.model import Region
from airborne.body import BodyModel, Pose, PosedBody, SurfaceArrays, surface_of_segments
from airborne.body.chain import angles_near
from airborne.body.limits import JointLimits
from airborne.geometry.joint_rotations import compose_rotation_vectors
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles
from airborne.geometry.sampling import sobol_points
from airborne.kernels import kernel
from airborne.rendering import EvidenceMaps, mask_evidence, mask_out_surface
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Array32

_N_FIRST = 24  # survivors of the starts
_ROUNDS = ((512, 24), (512, 16), (512, 3))  # proposals, survivors; the sds are halved in each round
_REACH_RAD = 0.7  # sd of the first proposals, for each joint and axis
_N_WIDE, _LARGE_RAD = 1024, np.radians(50)  # starts all over the ranges, of those axes whose half is larger
DISTINCT_M = 0.1  # two places of a limb, of which some joint is this far apart: about the width of an arm
# of a joint: poses further apart are two places, not one; on synthetic people such frames hold 40 of 42 in which a
# joint is over 80 mm off, and 22 of 68 others
APART_M = 0.05
SAME_M = 0.02  # fits from two places of a limb that are no further apart end in the same
# of all places elsewhere, before a search ends at its starts; chosen on synthetic people in two and three views: of 657
# searches 271 end, of which 3 moved a limb, by 33 to 59 mm; with 0 nats 372, of which 8, by up to 0.6 m
_CLEARLY_LESS_NATS = 1.0
_FEWEST_PX = 25  # a segment with fewer visible pixels in a view is occluded there, not misplaced
_SUSPECT = 0.5  # share of the body's precision, below which a segment is suspect
# share of a segment's pixels in a view that are surely not body, of a probability below 0.02, above which it is
# misplaced. On six synthetic people, and the same in two views, 33 to 48 % of limbs 0.1 m off have such a segment, and
# 3 to 5 % of right ones; a suspect one 30 to 39 %, but 8 to 10 % of right ones, before what looks like them
_SURELY_OTHER, _MISPLACED = 0.02, 0.25


class LimbFaults(NamedTuple):
    """Limbs, as segment indices, that may be misplaced."""

    suspect: list[NDArray[np.int64]]  # some segment covers pixels that are less like the body than the body's others
    misplaced: list[NDArray[np.int64]]  # some segment covers pixels that are surely something else


def find_misplaced_limbs(
    render_model: RenderModel, pose: Pose, regions: Sequence[Region], posteriors: Sequence[Array32]
) -> LimbFaults:
    """Find the limbs of which some segment covers pixels unlike the body in some view."""
    n = len(render_model.model.segments)
    posed, (pixels, inside, other) = render_model.with_pose(pose), np.zeros((3, len(regions), n))
    for row, (region, posterior) in enumerate(zip(regions, posteriors, strict=True)):
        part, segment_of_part = render_model.draw_parts(posed, region), render_model.segment_of_part
        _count_pixels(part, segment_of_part, posterior, pixels[row], inside[row], other[row])
    precision, is_shown = inside.sum() / max(pixels.sum(), 1), pixels >= _FEWEST_PX
    is_misplaced = is_shown & (other > _MISPLACED * pixels)
    is_suspect = is_shown & (inside < _SUSPECT * precision * pixels)
    return LimbFaults(*(_limbs_with(render_model.model, each) for each in (is_suspect, is_misplaced)))


@kernel
def _count_pixels(part, segment_of_part, posterior, pixels, inside, other):
    """Add to each segment's (n,) pixels, their probability to be body, and those that surely are something else.

    part (h, w) as `draw_parts`, segment_of_part (parts,), posterior (h, w).
    """
    for y in range(part.shape[0]):
        for x in range(part.shape[1]):
            if part[y, x] >= 0:
                owner, probability = segment_of_part[part[y, x]], posterior[y, x]
                pixels[owner] += 1
                inside[owner] += probability
                other[owner] += probability < _SURELY_OTHER


def _limbs_with(model: BodyModel, chosen: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Return the limbs of which some segment is chosen in some view (views, segments)."""
    limb, is_chosen = limb_of_segment(model), np.any(chosen, axis=0)
    return [np.flatnonzero(limb == each) for each in np.unique(limb[is_chosen & (limb >= 0)])]


def search_limb(
    render_model: RenderModel, poses: Sequence[Pose], limb: NDArray[np.int64], maps: EvidenceMaps, *, shared: float
) -> list[Pose]:
    """Return the poses with the most evidence when one limb moves from where the given poses have it.

    The poses differ in that limb only, and each from every other. The search starts from all over the joints' ranges
    too; the first pose alone is returned where all that lie elsewhere have clearly less evidence. `shared`: how many
    pixels are as much evidence as one by itself.
    """
    joints, root = limb - 1, poses[0].world_from_root
    angles = np.stack([pose.joint_angles for pose in poses])  # (candidates, joints, 3)
    limits = JointLimits.stack(render_model.model.segments[segment].limits for segment in limb)
    reach = np.minimum(limits.half_rad.ravel() / 2, _REACH_RAD)  # a hinge is searched about its one axis
    anywhere = np.concatenate([angles, _all_over(limits, joints, angles[0])])
    is_own = np.isin(np.arange(len(render_model.model.segments)), limb)
    posed = render_model.with_pose(poses[0])
    left = mask_out_surface(surface_of_segments(render_model.geometry, ~is_own), maps, posed.R, posed.t)
    search = _LimbSearch(render_model.model, limb, surface_of_segments(render_model.geometry, is_own), root, left)
    scores, places = search.weigh(anywhere)
    is_elsewhere = np.linalg.norm(places - places[0], axis=2).max(axis=1) > DISTINCT_M
    if scores[0] - scores[is_elsewhere].max(initial=-np.inf) > _CLEARLY_LESS_NATS * shared:
        return [poses[0]]
    angles = anywhere[_most_evident(scores, places, _N_FIRST)]
    for number, (n_proposals, n_survivors) in enumerate(_ROUNDS):
        steps = ndtri(sobol_points(3 * len(limb), n_proposals, seed=number)) * reach / 2**number
        proposed = angles[np.arange(n_proposals) % len(angles)]
        angles_of_limb = np.ascontiguousarray(proposed[:, joints]).reshape(-1, 3)
        turned = compose_rotation_vectors(angles_of_limb, steps.reshape(-1, 3)).reshape(n_proposals, len(limb), 3)
        proposed[:, joints] = angles_near(limits.clamp(matrix_from_angles(turned)), turned)
        proposed = np.concatenate([angles, proposed])
        angles = proposed[_most_evident(*search.weigh(proposed), n_survivors)]
    return [replace(poses[0], joint_angles=each) for each in angles]


def limb_distance(model: BodyModel, pose: Pose, other: Pose, limb: NDArray[np.int64]) -> float:
    """Return how far apart a limb's joints and landmarks are in two poses, at most [m]."""
    if pose is other:
        return 0.0
    here, there = limb_points(model, [model.with_pose(each) for each in (pose, other)], limb)
    return float(np.linalg.norm(here - there, axis=1).max())


def is_same_place(model: BodyModel, pose: Pose, other: Pose, limb: NDArray[np.int64] | None = None) -> bool:
    """Whether two poses have a limb, or all of the body, in one place: no joint or landmark is `APART_M` apart."""
    limb = np.arange(len(model.segments)) if limb is None else limb
    return limb_distance(model, pose, other, limb) < APART_M


def limb_points(model: BodyModel, bodies: Sequence[PosedBody], limb: NDArray[np.int64]) -> list[Array]:
    """Return where each posed body has a limb's joints and landmarks: (points, 3) world [m]."""
    is_mark = np.isin(model.landmark_segments, limb)
    return [np.concatenate([body.t[limb], body.landmarks[is_mark]]) for body in bodies]


def with_limb(pose: Pose, other: Pose, limb: NDArray[np.int64]) -> Array:
    """Return the joint angles of a pose, with one limb's from another pose."""
    angles = pose.joint_angles.copy()
    angles[limb - 1] = other.joint_angles[limb - 1]
    return angles


@dataclass(frozen=True, slots=True, eq=False)
class _LimbSearch:
    """A limb, drawn alone on what the rest of the body leaves of the evidence."""

    model: BodyModel
    limb: NDArray[np.int64]
    surface: SurfaceArrays
    root: RigidTransform
    maps: EvidenceMaps

    def weigh(self, angles: Array) -> tuple[Array, Array]:
        """Return the evidence of joint angles (m, joints, 3), and where they have the limb: (m, segments, 3) [m]."""
        R = np.broadcast_to(self.root.rotation.as_matrix(), (len(angles), 3, 3))
        t = np.broadcast_to(self.root.translation, (len(angles), 3))
        R, t = self.model.pose_segments(R, t, angles)
        return mask_evidence(self.surface, self.maps, R, t).sum(axis=1), t[:, self.limb]


def _most_evident(scores: Array, places: Array, n: int) -> NDArray[np.int64]:
    """Return which n of the scores (m,) are the highest, best first, of places (m, joints, 3) [m] that are distinct."""
    return _distinct_places(np.argsort(-scores, kind="stable"), places, DISTINCT_M, n)


@kernel
def _distinct_places(order, places, least, n):
    """Return the first n of `order` of which some joint is `least` or more away from that in each one taken before.

    places (candidates, joints, 3) [m].
    """
    taken, n_taken = np.empty(n, np.int64), 0
    for candidate in order:
        is_new = True
        for k in range(n_taken):
            farthest = 0.0
            for joint in range(places.shape[1]):
                squared = 0.0
                for axis in range(3):
                    squared += (places[candidate, joint, axis] - places[taken[k], joint, axis]) ** 2
                farthest = max(farthest, squared)
            if farthest <= least**2:
                is_new = False
                break
        if is_new:
            taken[n_taken] = candidate
            n_taken += 1
            if n_taken == n:
                break
    return taken[:n_taken]


def _all_over(limits: JointLimits, joints: NDArray[np.int64], angles: Array) -> Array:
    """Return joint angles (n, joints, 3) with one limb's joints anywhere in their ranges, as far as these are large."""
    turned = limits.coordinates(matrix_from_angles(angles[joints]))
    anywhere = (2 * sobol_points(turned.size, _N_WIDE, seed=0).reshape(-1, *turned.shape) - 1) * limits.half_rad
    turned = limits.nearest(np.where((limits.half_rad > _LARGE_RAD) & np.isfinite(anywhere), anywhere, turned))
    proposed = np.broadcast_to(angles, (_N_WIDE, *angles.shape)).copy()
    proposed[:, joints] = angles_from_matrix(limits.rotation(turned))
    return proposed
