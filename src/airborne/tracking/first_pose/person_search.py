"""Search a person: postures in all orientations, then rounds of moves of limbs and trunk, each fitted to silhouettes.

A pose is judged by the share of the evidence that its mask covers, and by how much the parts that it gives to pixels
tell of their colours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.special import ndtri

from airborne.body import BodyModel, Pose
from airborne.body.chain import clamp_angles, clamp_to_limits, joint_angles_of
from airborne.body.limits import JointLimits
from airborne.geometry.joint_rotations import compose_rotation_vectors
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles, super_fibonacci
from airborne.geometry.sampling import sobol_points
from airborne.rendering import mask_evidence, mask_out_surface
from airborne.rendering.threads import in_threads
from airborne.tracking.first_pose.colour_information import PixelColours, colour_classes
from airborne.tracking.first_pose.moments import Moment, crop_probability
from airborne.tracking.first_pose.person import THREADS, JointedBody, Limb, PoseSet, SilhouetteEvidence, apart
from airborne.tracking.first_pose.places import Place
from airborne.tracking.first_pose.postures import library, limb_postures
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, all_joints
from airborne.tracking.model_based.gauss_newton import Posteriors, PyramidLevels, fit_silhouettes
from airborne.tracking.model_based.left_right_swap import swap_limbs
from airborne.types import Array

_N_ORIENTATIONS = 300  # about 20 degrees from any orientation to the nearest
_BLUR_M, _LIMB_BLUR_M = 0.11, 0.06  # of the evidence: for postures, and for their limbs
_N_BEST, _N_STARTS, _N_FITTED = 6000, 160, 48  # postures looked at, apart in their trunks, fitted with their limbs
_APART_M, _LEAST_APART_M = 0.1, 0.05  # mean distance of landmarks by which poses differ: the first, and the last
_FAR: PyramidLevels = ((4, 4), (2, 3))  # reduction of the small pictures, steps
_FINE: PyramidLevels = ((2, 3), (1, 3))  # the same
_FIT_SD = 1.0  # [m, rad] of a fit's prior about where it starts
_REACH_RAD = 0.5  # sd of a limb's moves, for each joint and axis
_N_JUDGED = 5  # moves of a limb that are judged by colours too
_COLOUR_WEIGHT = 1.0  # of a nat a pixel about colours, against all of the evidence
_MARGIN_PX = 16  # around the poses, of the small pictures
_TRUNK_SD_RAD, _TRUNK_SD_M = 0.35, 0.03  # of the trunk's turns
_N_POLISHED, _N_SMALL, _SHARE_MOVED = 20, 48, 0.25  # rounds, moves in each, share of the joints that one moves
_POLISH_SD_M, _POLISH_SD_RAD = 0.02, 0.15  # of the first round's moves
_HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about a segment's long axis


@dataclass(frozen=True, eq=False)
class Judge:
    """What one moment shows of a person, and how well poses agree with it."""

    person: JointedBody
    moment: Moment
    silhouettes: SilhouetteEvidence
    colours: PixelColours
    classes: NDArray[np.int64]  # (parts,)

    def shares(self, poses: PoseSet) -> Array:
        """Return the shares of the evidence that the masks cover: (n,)."""
        return self.silhouettes.shares(self.person, poses)

    def __call__(self, poses: PoseSet) -> Array:
        """Return how well each pose agrees: (n,)."""
        render_model = self.person.render_model
        told = [self.colours.information(render_model, posed, self.classes) for posed in self.person.bodies(poses)]
        return self.shares(poses) + _COLOUR_WEIGHT * np.array(told)


def first_poses(person: JointedBody, moment: Moment, place: Place) -> tuple[PoseSet, Judge]:
    """Return poses to start from, and what judges them."""

    def silhouettes(scale: int, blur_m: float) -> SilhouetteEvidence:
        return SilhouetteEvidence.around(person, moment, place.position, scale=scale, blur_m=blur_m)

    poses = _pose_library(person, silhouettes(4, _BLUR_M), place.position)
    poses = _move_limbs(person, poses, silhouettes(4, _LIMB_BLUR_M), 64, seed=0)
    sharp = silhouettes(2, 0.0)
    order = np.argsort(-sharp.shares(person, poses), kind="stable")[:_N_FITTED]
    poses = _fit(person, moment, poses[order], _FAR)
    return poses, Judge(person, moment, sharp, PixelColours.of(sharp), colour_classes(person.model))


def improve(
    judge: Judge, poses: PoseSet, *, n_kept: int, n_moves: int, seed: int, narrower: float = 1.0, is_rough: bool = False
) -> PoseSet:
    """Move and fit the best poses; return them, where they were moved to, and where the fit ended from there.

    `narrower` is a factor on moves that are not all over the ranges.
    """
    person = judge.person
    poses = poses[apart(person.landmarks(poses), judge(poses), n_kept, 0.8 * _APART_M if is_rough else _LEAST_APART_M)]
    moved = poses
    if not is_rough:
        best = poses[:3]
        turned = _turn_trunk(person, best, seed, narrower)
        moved = PoseSet.join(poses, _mirror(person, best), turned, _swap(person, best))
    moved = _move_limbs(
        person, moved, judge.silhouettes, n_moves, seed=seed, narrower=narrower, judge=None if is_rough else judge
    )
    return PoseSet.join(poses, moved, _fit(person, judge.moment, moved, _FAR if is_rough else _FINE))


def polish(judge: Judge, pose: Pose, seed: int = 0) -> Pose:
    """Search around a pose for a better one by small random moves, narrower from round to round.

    Fits to silhouettes end beside the best pose, by what the body's shape is off and by limbs that hide each other.
    """
    person, rng = judge.person, np.random.default_rng(seed)
    n_dofs = person.model.n_dofs
    best = PoseSet.of([pose])
    best_value = judge(best)[0]
    for number in range(_N_POLISHED):
        sd = np.repeat([_POLISH_SD_M, _POLISH_SD_RAD], [3, n_dofs - 3]) * 0.85**number
        is_moved = np.repeat(rng.random((_N_SMALL, n_dofs // 3)) < _SHARE_MOVED, 3, axis=1)
        deltas = rng.normal(0, sd, (_N_SMALL, n_dofs)) * is_moved
        tried = _move(person.model, best, deltas)
        tried = tried[np.argsort(-judge.shares(tried), kind="stable")[:_N_JUDGED]]
        values = judge(tried)
        if values.max() > best_value:
            best, best_value = tried[values.argmax() : values.argmax() + 1], values.max()
    return best.each()[0]


def _move(model: BodyModel, pose: PoseSet, deltas: Array) -> PoseSet:
    """Change one pose in many ways, as `move_pose` does: deltas (n, 6 + 3 joints); joints keep their limits."""
    R = Rotation.from_rotvec(deltas[:, 3:6]).as_matrix() @ pose.R
    angles = np.tile(pose.angles, (len(deltas), 1, 1))
    turned = compose_rotation_vectors(angles.reshape(-1, 3), deltas[:, 6:].reshape(-1, 3)).reshape(angles.shape)
    return PoseSet(R, pose.t + deltas[:, :3], clamp_angles(model, turned))


def _pose_library(person: JointedBody, silhouettes: SilhouetteEvidence, at: Array) -> PoseSet:
    """Return the postures and orientations that cover most, apart in their trunks, their middles at a place."""
    postures, R = library(person.model), super_fibonacci(_N_ORIENTATIONS)
    n = len(postures)
    upright = PoseSet(np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3)), postures)
    middle = person.middles(upright)
    t = at - np.einsum("oij,nj->noi", R, middle).reshape(-1, 3)
    poses = PoseSet(np.tile(R, (n, 1, 1)), t, np.repeat(postures, len(R), axis=0))
    shares = silhouettes.shares(person, poses)
    best = np.argsort(-shares, kind="stable")[:_N_BEST]
    trunks = person.landmarks(poses[best])[:, person.trunk]
    return poses[best[apart(trunks, shares[best], _N_STARTS, _APART_M)]]


def _move_limbs(
    person: JointedBody,
    poses: PoseSet,
    silhouettes: SilhouetteEvidence,
    n: int,
    *,
    seed: int,
    narrower: float = 1.0,
    judge: Judge | None = None,
) -> PoseSet:
    """Move one limb after the other to where it covers most: n moves anywhere, and n near where it is."""
    angles = poses.angles.copy()
    for limb in person.limbs:
        joints = limb.segments - 1
        moves = np.concatenate(
            [
                angles[:, None, joints],
                _limb_moves(person.model, limb, angles[:, joints], n, seed=seed, narrower=narrower),
            ],
            axis=1,
        )
        m, k = moves.shape[:2]
        tried = np.repeat(angles, k, axis=0)
        tried[:, joints] = moves.reshape(m * k, -1, 3)
        moved = PoseSet(np.repeat(poses.R, k, axis=0), np.repeat(poses.t, k, axis=0), tried)
        covered = _limb_coverage(person, limb, moved, silhouettes, k=k)
        best = covered.argmax(axis=1)
        if judge is not None:
            order = np.argsort(-covered, axis=1, kind="stable")[:, :_N_JUDGED]
            order[:, -1] = 0  # as it is
            judged = judge(moved[(np.arange(m)[:, None] * k + order).ravel()]).reshape(order.shape)
            best = order[np.arange(m), judged.argmax(axis=1)]
        angles[:, joints] = moves[np.arange(m), best]
    return replace(poses, angles=angles)


def _limb_coverage(
    person: JointedBody, limb: Limb, moved: PoseSet, silhouettes: SilhouetteEvidence, *, k: int
) -> Array:
    """Return what a limb covers beyond the rest of the body, of moves (m k) that k by k share it: (m, k)."""
    R, t = person.segments(moved)
    out = np.zeros((len(R) // k, k))

    def fill(part: slice) -> None:
        for i in range(part.start, part.stop):
            rows = slice(i * k, (i + 1) * k)
            maps = mask_out_surface(limb.rest, silhouettes.maps, R[i * k], t[i * k])
            out[i] = mask_evidence(limb.alone, maps, R[rows], t[rows]).sum(axis=1)

    in_threads(fill, len(out), THREADS)
    return out


def _limb_moves(model: BodyModel, limb: Limb, angles: Array, n: int, *, seed: int, narrower: float) -> Array:
    """Return a limb's joint angles, n anywhere and n near `angles` (m, joints, 3): (m, 2 n, joints, 3)."""
    m, joints = angles.shape[:2]
    shape = (m, n, joints, 3)
    limits = JointLimits.stack(model.segments[segment].limits for segment in limb.segments)
    anywhere = limb_postures(model, limb.segments, n, seed)
    points = np.clip(sobol_points(3 * joints, n, seed=seed + 1), 1e-3, 1 - 1e-3)
    steps = ndtri(points).reshape(n, joints, 3) * np.minimum(limits.half_rad / 2, narrower * _REACH_RAD)
    near = compose_rotation_vectors(
        np.ascontiguousarray(np.broadcast_to(angles[:, None], shape)).reshape(-1, 3),
        np.ascontiguousarray(np.broadcast_to(steps, shape)).reshape(-1, 3),
    )
    near = angles_from_matrix(limits.clamp(matrix_from_angles(near.reshape(m * n, joints, 3))))
    return np.concatenate([np.broadcast_to(anywhere, shape), near.reshape(shape)], axis=1)


def _mirror(person: JointedBody, poses: PoseSet) -> PoseSet:
    """Turn bodies about their long axes and exchange left and right: silhouettes hardly tell them apart."""
    names = [segment.name for segment in person.model.segments]
    other = {"left": "right", "right": "left"}
    sides = [name.rpartition("_") for name in names]
    swapped = [names.index(f"{stem}_{other[side]}") if side in other else i for i, (stem, _, side) in enumerate(sides)]
    R, _ = person.segments(poses)
    mirrored = _with_rotations(person, poses, R[:, swapped] @ _HALF_TURN)
    return replace(mirrored, t=mirrored.t + person.middles(poses) - person.middles(mirrored))


def _turn_trunk(person: JointedBody, poses: PoseSet, seed: int, narrower: float) -> PoseSet:
    """Turn trunks a little, twice each; the limbs stay as they are turned."""
    rng = np.random.default_rng(seed)
    poses = poses[np.repeat(np.arange(len(poses)), 2)]
    R, _ = person.segments(poses)
    moved = {int(segment) for limb in person.limbs for segment in limb.segments}
    trunk = [i for i in range(R.shape[1]) if i not in moved]
    turns = Rotation.from_rotvec(rng.normal(0, narrower * _TRUNK_SD_RAD, (len(poses), 3))).as_matrix()
    R[:, trunk] = turns[:, None] @ R[:, trunk]
    return _with_rotations(person, replace(poses, t=poses.t + rng.normal(0, narrower * _TRUNK_SD_M, poses.t.shape)), R)


def _with_rotations(person: JointedBody, poses: PoseSet, R: Array) -> PoseSet:
    """Return poses with all segments turned to R (n, s, 3, 3), as far as the joints allow."""
    angles = joint_angles_of(person.model, R)
    return PoseSet.of(
        [
            clamp_to_limits(
                person.model,
                Pose(world_from_root=RigidTransform.from_components(t, Rotation.from_matrix(root)), joint_angles=each),
            )
            for t, root, each in zip(poses.t, R[:, 0], angles, strict=True)
        ]
    )


def _swap(person: JointedBody, poses: PoseSet) -> PoseSet:
    """Exchange the arms of bodies, and the legs."""
    return PoseSet.of([swapped for pose in poses.each() for swapped in swap_limbs(person.model, pose)])


def _fit(person: JointedBody, moment: Moment, poses: PoseSet, levels: PyramidLevels) -> PoseSet:
    """Fit everything to the silhouettes."""
    masks = Posteriors(*crop_probability(moment, person.bodies(poses), person.render_model.geometry, _MARGIN_PX))
    dofs, sd = all_joints(person.model), np.full(person.model.n_dofs, _FIT_SD)

    def fit(pose: Pose) -> Pose:
        prior = PosePrior(pose, sd)
        return fit_silhouettes(person.render_model, pose, masks, levels=levels, dofs=dofs, prior=prior)

    return PoseSet.of([fit(pose) for pose in poses.each()])
