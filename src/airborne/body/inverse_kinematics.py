"""From landmarks to a pose: the joint angles, within their limits, that bring a body's landmarks to targets.

Least squares over the root and all joint angles: the landmarks' distances, and a weak prior on the angles, so that
what the landmarks leave open (the axial rotation of a straight arm) stays near neutral. Damped Gauss-Newton steps
within the limits; the trunk first, then each limb from several starts, then all together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.chain import chain_of, clamp_to_limits, subtree
from airborne.body.landmark_fit import (
    COARSE_GAIN,
    LandmarkProblem,
    PoseState,
    landmark_distances,
    landmark_positions,
    minimise,
)
from airborne.body.model import BodyModel, Pose
from airborne.body.sides import other_side
from airborne.errors import BodyError
from airborne.geometry.rotations import angles_from_matrix
from airborne.types import Array

CORE = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")  # they give a person's position and heading
_LEAST_SD_M, _MOST_SD_M = 0.003, 0.05  # of a landmark; between them, the RMS of the fit
_LEAST_WIDTH_M = 0.02  # second principal sd: landmarks on a line leave the rotation about it open
_SHARES = np.linspace(-0.96, 0.96, 7)  # of a joint's half range: where a limb's search starts
_FIRST_STEPS, _N_GO_ON = 5, 2  # of a limb: from every start; starts that go on: half the time of all, RMS + 0.1 mm
_N_RESTARTS, _WORTHWHILE_SHARE = 3, 0.95  # restarts of the limbs, while each brings the cost below this share


@dataclass(frozen=True, slots=True, eq=False)
class PoseFit:
    """A pose that brings a body's landmarks near their targets."""

    pose: Pose
    residual_m: dict[str, float]  # landmark -> distance from its target [m]; NaN without a target
    rms_m: float  # over the landmarks with a target [m]


def fit_pose(
    model: BodyModel,
    targets: Mapping[str, Array],
    *,
    weights: Mapping[str, float] | None = None,
    start: Pose | None = None,
    n_restarts: int = _N_RESTARTS,
) -> PoseFit:
    """Find the pose whose landmarks lie nearest to targets: landmark -> (3,) world [m], NaN where unknown.

    `weights` are those of each landmark's squared distance, 1 where not named. The search starts from `start`; without
    one it needs both hips and both shoulders, or, for a body without these, any three landmarks not on a line, and
    tries the limbs anew up to `n_restarts` times. Raises BodyError for landmarks that the body does not have, and where
    too few have targets.
    """
    names = [landmark.name for landmark in model.landmarks]
    unknown = [name for name in targets if name not in names]
    if unknown:
        raise BodyError(f"body '{model.name}' has no landmark {', '.join(unknown)}; it has: {', '.join(names)}")
    positions = np.full((len(names), 3), np.nan)
    for name, position in targets.items():
        positions[names.index(name)] = position
    root_weights = np.sqrt([(weights or {}).get(name, 1.0) for name in names])
    problem = LandmarkProblem(model, positions, root_weights, _LEAST_SD_M)
    _check(problem, names, has_start=start is not None)
    pose, residual_m, rms_m = _fit(problem, start, n_restarts)
    return PoseFit(pose, dict(zip(names, residual_m.tolist(), strict=True)), rms_m)


def fit_lengths(model: BodyModel, joints: Array) -> dict[str, float]:
    """Measure the lengths of a person's segments, relative to the model's.

    joints (frames, landmarks, 3) world [m] in the model's order of landmarks; NaN where unknown. A limb segment's
    length is from the landmark at its joint to those fixed in it or at its children's joints; the trunk's, one scale
    for all its segments, from mid-hip to mid-shoulder; the shoulder girdles' follows from the width of the shoulders.
    Medians over frames and both sides; segments that are never seen are left out.
    """
    names = [landmark.name for landmark in model.landmarks]
    rest = model.with_pose(Pose(world_from_root=RigidTransform.identity())).landmarks
    carriers = [_carriers(model, i) for i in range(len(names))]
    pairs: dict[str, list[Array]] = {}
    for index, segment in enumerate(model.segments):
        at_joint = [i for i, c in enumerate(carriers) if c[0] == index and c[-1] != index]
        for a in at_joint:
            for b in (i for i, c in enumerate(carriers) if index in c and i not in at_joint):
                ratio = np.linalg.norm(joints[:, b] - joints[:, a], axis=-1) / np.linalg.norm(rest[b] - rest[a])
                for name in {segment.name, other_side(segment.name)}:
                    pairs.setdefault(name, []).append(ratio)
    if set(CORE) <= set(names):
        pairs |= _trunk_ratios(model, joints[:, [names.index(name) for name in CORE]])
    segments = {segment.name for segment in model.segments}
    by_segment = {name: np.concatenate(ratios) for name, ratios in pairs.items() if name in segments}
    return {name: float(np.nanmedian(ratio)) for name, ratio in by_segment.items() if np.isfinite(ratio).any()}


def _trunk_ratios(model: BodyModel, core: Array) -> dict[str, list[Array]]:
    """Return the trunk's and the shoulder girdles' scales (frames,) by segment, from CORE points (frames, 4, 3)."""
    rest = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    tops = [next(mark.segment for mark in model.landmarks if mark.name == name) for name in CORE]
    at_rest = rest.t[[model.index_of(name) for name in tops]]
    reach, own_reach = (p[..., 2:, :].mean(axis=-2) - p[..., :2, :].mean(axis=-2) for p in (core, at_rest))
    ratio = np.linalg.norm(reach, axis=-1) / np.linalg.norm(own_reach)
    shared = set.intersection(*_core_chains(model)[2:])
    ratios = {model.segments[index].name: [ratio] for index in shared}
    girdles = [int(model.parents[model.index_of(name)]) for name in tops[2:]]
    if not shared & {*girdles}:
        width, own_width = (np.linalg.norm(p[..., 2, :] - p[..., 3, :], axis=-1) for p in (core, at_rest))
        gap = np.linalg.norm(rest.t[girdles[0]] - rest.t[girdles[1]])
        ratios |= {model.segments[index].name: [(width - gap) / (own_width - gap)] for index in girdles}
    return ratios


def _fit(problem: LandmarkProblem, start: Pose | None, n_restarts: int) -> tuple[Pose, Array, float]:
    """Return the pose, each landmark's distance (landmarks,) [m] and their RMS, targets only [m]."""
    n_joints = len(problem.model.segments) - 1
    if start is None:
        state = _initial_state(problem)
    else:
        root = start.world_from_root
        angles = start.joint_angles if start.joint_angles.size else np.zeros((n_joints, 3))
        problem = replace(problem, neutral=angles)
        state = PoseState(root.rotation.as_matrix(), root.translation, problem.prior)
    everything = np.ones(6 + 3 * n_joints, bool)
    state, cost = minimise(problem, state, everything)
    for _ in range(n_restarts if start is None else 0):
        again, cost_again = minimise(problem, _fit_limbs(problem, state), everything)
        if cost_again > _WORTHWHILE_SHARE * cost:
            break
        state, cost = again, cost_again
    sd_m = float(np.clip(_rms(landmark_distances(problem, state)), _LEAST_SD_M, _MOST_SD_M))
    state, _ = minimise(replace(problem, sd_m=sd_m), state, everything)
    root = RigidTransform.from_components(state.t, Rotation.from_matrix(state.R))
    pose = clamp_to_limits(problem.model, Pose(world_from_root=root, joint_angles=state.angles))
    off_m = landmark_distances(problem, replace(state, angles=pose.joint_angles))
    return pose, off_m, _rms(off_m)


def _initial_state(problem: LandmarkProblem) -> PoseState:
    """Return initial values: the trunk first, then each limb from several starts."""
    model = problem.model
    names = [landmark.name for landmark in model.landmarks]
    core = np.array([name in CORE for name in names]) if set(CORE) <= set(names) else np.ones(len(names), bool)
    with_target = core & problem.is_given
    straight = PoseState(np.eye(3), np.zeros(3), problem.prior)
    state = _align(straight, landmark_positions(problem, straight)[with_target], problem.targets[with_target])
    if not set(CORE) <= set(names):
        return state
    trunk = replace(problem, targets=np.where(core[:, None], problem.targets, np.nan))
    state, _ = minimise(trunk, state, _variables(model, set.union(*_core_chains(model)) - {0}))
    return _fit_limbs(problem, state)


def _fit_limbs(problem: LandmarkProblem, state: PoseState) -> PoseState:
    """Fit each limb of a body that has limbs, one after the other."""
    landmarks = {landmark.name: landmark for landmark in problem.model.landmarks}
    for name in CORE if set(CORE) <= set(landmarks) else ():
        state = _fit_limb(problem, state, problem.model.index_of(landmarks[name].segment))
    return state


def _fit_limb(problem: LandmarkProblem, state: PoseState, top: int) -> PoseState:
    """Fit the limb that begins with segment `top`, and its girdle; the rest is fixed.

    Of a grid over its first two joints, minimise from the best point of each axial rotation.
    """
    model = problem.model
    limb = subtree(model, top)
    is_own = np.isin(problem.model.landmark_segments, limb)
    if not (problem.is_given & is_own).any():
        return state
    alone = replace(problem, targets=np.where(is_own[:, None], problem.targets, np.nan))
    girdle = [index for index in chain_of(model, top)[:-1] if sum(index in chain for chain in _core_chains(model)) == 1]
    joints = np.array(limb[:2]) - 1
    first, last = (model.segments[limb[k]].limits for k in (0, len(joints) - 1))
    half = np.minimum(np.stack([first.half_rad, last.half_rad]), np.pi)
    bend = int(np.argmax(half[-1, :2]))  # the axis about which a knee or an elbow flexes
    x, y, twist, b = np.meshgrid(*(_SHARES * each for each in (*half[0], half[-1, bend])), indexing="ij")
    angles = np.broadcast_to(state.angles, (*x.shape, *state.angles.shape)).copy()
    angles[..., [index - 1 for index in girdle], :] = problem.prior[[index - 1 for index in girdle]]
    bent = last.rotation(b[..., None] * np.eye(3)[bend])
    angles[..., joints[-1], :] = angles_from_matrix(bent)
    turned = first.rotation(first.nearest(np.stack([x, y, twist], axis=-1)))
    angles[..., joints[0], :] = angles_from_matrix(turned)
    costs = np.nansum(landmark_distances(alone, replace(state, angles=angles)) ** 2, axis=-1)
    starts = [state]
    for spin in range(len(_SHARES)):
        best = np.unravel_index(np.argmin(costs[:, :, spin]), costs[:, :, spin].shape)
        starts.append(replace(state, angles=angles[:, :, spin][best]))
    free = _variables(model, [*girdle, *limb], root=False)
    tried = [minimise(alone, start, free, COARSE_GAIN, most_steps=_FIRST_STEPS) for start in starts]
    best = sorted(tried, key=lambda result: result[1])[:_N_GO_ON]
    return min((minimise(alone, start, free, COARSE_GAIN) for start, _ in best), key=lambda result: result[1])[0]


def _rms(distance: Array) -> float:
    return float(np.sqrt(np.nanmean(distance**2)))


def _align(state: PoseState, points: Array, targets: Array) -> PoseState:
    """Align the whole body rigidly: points (n, 3) to targets (n, 3), least squares."""
    R = Rotation.align_vectors(targets - targets.mean(axis=0), points - points.mean(axis=0))[0].as_matrix()
    return PoseState(R @ state.R, targets.mean(axis=0) + R @ (state.t - points.mean(axis=0)), state.angles)


def _check(problem: LandmarkProblem, names: list[str], *, has_start: bool) -> None:
    """Raise BodyError for targets that do not determine the root."""
    present = [name for name, is_given in zip(names, problem.is_given, strict=True) if is_given]
    needed = CORE if set(CORE) <= set(names) else ()
    missing = [name for name in needed if name not in present]
    if missing and not has_start:
        raise BodyError(f"a pose needs both hips and both shoulders; not given: {', '.join(missing)}")
    spread = np.zeros(3) if len(present) < 3 else np.linalg.eigvalsh(np.cov(problem.targets[problem.is_given].T))
    if not present or (not has_start and spread[1] < _LEAST_WIDTH_M**2):
        listed = ", ".join(present) or "none"
        raise BodyError(f"a pose of body '{problem.model.name}' needs three landmarks off a line; given: {listed}")


def _carriers(model: BodyModel, landmark: int) -> list[int]:
    """Return the segments in which a landmark is fixed: its own, and at the segment's origin the parent too."""
    own = int(model.landmark_segments[landmark])
    return [own, int(model.parents[own])] if model.landmarks[landmark].at_joint and own > 0 else [own]


def _core_chains(model: BodyModel) -> list[set[int]]:
    """Return the segments above each hip's and shoulder's joint, the root among them."""
    owners = {landmark.name: model.index_of(landmark.segment) for landmark in model.landmarks}
    return [{*chain_of(model, owners[name])} - {owners[name]} for name in CORE]


def _variables(model: BodyModel, segments: Iterable[int], *, root: bool = True) -> NDArray[np.bool_]:
    """Mark the variables of the root and of some segments' joints: (6 + 3 joints,)."""
    free = np.zeros(6 + 3 * (len(model.segments) - 1), bool)
    free[:6] = root
    for index in segments:
        free[3 + 3 * index : 6 + 3 * index] = True
    return free
