"""From landmarks to a pose: the joint angles, within their limits, that bring a body's landmarks to given places.

Least squares over the root and all joint angles: the landmarks' distances, and weakly the angles themselves, so that
what the landmarks leave open (the spin of a straight arm) stays near neutral. Damped Gauss-Newton steps within the
limits; the trunk first, then each limb from several starts, then all together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.landmark_fit import COARSE, Problem, State, distances, places, solved
from airborne.body.model import BodyModel, Pose
from airborne.errors import BodyError

Array = NDArray[np.floating]

CORE = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")  # they say where a person is and faces
LEAST_SD_M, MOST_SD_M = 0.003, 0.05  # of a landmark; between them, what the fit itself shows
SUSPECT_M, EXCHANGED = 0.02, 0.5  # an RMS over this, half of it with left and right exchanged: they look exchanged
LEAST_WIDTH_M = 0.02  # second largest spread of the landmarks: on one line they leave the turn about it open
_SHARES = np.linspace(0.02, 0.98, 7)  # shares of a joint's range that a limb's search begins at
_N_AGAIN, _BETTER = 3, 0.95  # times that the limbs are tried again, while that brings the cost below this share


@dataclass(frozen=True, slots=True, eq=False)
class PoseFit:
    """A pose that brings a body's landmarks near their targets."""

    pose: Pose
    residual_m: dict[str, float]  # landmark -> distance from its target [m]; NaN where none was given
    rms_m: float  # of those given [m]
    note: str | None = None  # what looks wrong with the targets, in one line


def fit_pose(
    model: BodyModel,
    targets: Mapping[str, Array],
    *,
    weights: Mapping[str, float] | None = None,
    start: Pose | None = None,
) -> PoseFit:
    """Find the pose whose landmarks lie nearest to targets: landmark -> (3,) world [m], NaN where unknown.

    `weights` are what each landmark's squared distance counts, 1 where not named. The search begins at `start`; without
    one it needs both hips and both shoulders, of a body without these any three landmarks off a line. Raises BodyError
    for landmarks that the body does not have, and where too few are given.
    """
    names = [landmark.name for landmark in model.landmarks]
    unknown = [name for name in targets if name not in names]
    if unknown:
        raise BodyError(f"body '{model.name}' has no landmark {', '.join(unknown)}; it has: {', '.join(names)}")
    wanted = np.full((len(names), 3), np.nan)
    for name, place in targets.items():
        wanted[names.index(name)] = place
    root_weights = np.sqrt([(weights or {}).get(name, 1.0) for name in names])
    problem = Problem(model, wanted, root_weights, LEAST_SD_M)
    _check(problem, names, has_start=start is not None)
    pose, residual_m, rms_m = _fit(problem, start)
    note = None
    if start is None and rms_m > SUSPECT_M:
        other = [names.index(_other_side(name)) if _other_side(name) in names else i for i, name in enumerate(names)]
        exchanged_m = _fit(replace(problem, targets=wanted[other]), None)[2]
        if exchanged_m < EXCHANGED * rms_m:
            note = (
                f"left and right look exchanged: landmarks {rms_m * 1e3:.0f} mm off as named, "
                f"{exchanged_m * 1e3:.0f} mm the other way; check the points' names, and that no picture is mirrored"
            )
    return PoseFit(pose, dict(zip(names, residual_m.tolist(), strict=True)), rms_m, note)


def fit_lengths(model: BodyModel, joints: Array) -> dict[str, float]:
    """Measure a person's segments: how many times longer than the model's each is.

    joints (frames, landmarks, 3) world [m] in the model's order of landmarks; NaN where unknown. A limb segment's
    length is from the landmark at its joint to those fixed in it or at its children's joints; the trunk's, one scale
    for all its segments, from mid-hip to mid-shoulder; the shoulder girdles' follows from the width of the shoulders.
    Median over frames and both sides; what is never seen is left out.
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
                for name in {segment.name, _other_side(segment.name)}:
                    pairs.setdefault(name, []).append(ratio)
    if set(CORE) <= set(names):
        pairs |= _trunk_ratios(model, joints[:, [names.index(name) for name in CORE]])
    known = {segment.name for segment in model.segments}
    found = {name: np.concatenate(ratios) for name, ratios in pairs.items() if name in known}
    return {name: float(np.nanmedian(ratio)) for name, ratio in found.items() if np.isfinite(ratio).any()}


def _trunk_ratios(model: BodyModel, core: Array) -> dict[str, list[Array]]:
    """Return the trunk's and the shoulder girdles' scales (frames,) by segment, from CORE's places (frames, 4, 3)."""
    rest = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    tops = [next(mark.segment for mark in model.landmarks if mark.name == name) for name in CORE]
    at_rest = rest.t[[model.index_of(name) for name in tops]]
    reach, own_reach = (p[..., 2:, :].mean(axis=-2) - p[..., :2, :].mean(axis=-2) for p in (core, at_rest))
    ratio = np.linalg.norm(reach, axis=-1) / np.linalg.norm(own_reach)
    shared = set.intersection(*_core_chains(model)[2:])
    found = {model.segments[index].name: [ratio] for index in shared}
    girdles = [int(model.parents[model.index_of(name)]) for name in tops[2:]]
    if not shared & {*girdles}:
        width, own_width = (np.linalg.norm(p[..., 2, :] - p[..., 3, :], axis=-1) for p in (core, at_rest))
        gap = np.linalg.norm(rest.t[girdles[0]] - rest.t[girdles[1]])
        found |= {model.segments[index].name: [(width - gap) / (own_width - gap)] for index in girdles}
    return found


def _fit(problem: Problem, start: Pose | None) -> tuple[Pose, Array, float]:
    """Return the pose, each landmark's distance (landmarks,) [m] and the RMS of those given [m]."""
    n_joints = len(problem.model.segments) - 1
    if start is None:
        state = _start(problem)
    else:
        root = start.world_from_root
        angles = start.joint_angles if start.joint_angles.size else np.zeros((n_joints, 3))
        problem = replace(problem, neutral=angles)
        state = State(root.rotation.as_matrix(), root.translation, problem.prior)
    everything = np.ones(6 + 3 * n_joints, bool)
    state, cost = solved(problem, state, everything)
    for _ in range(_N_AGAIN if start is None else 0):
        again, cost_again = solved(problem, _limbs(problem, state), everything)
        if cost_again > _BETTER * cost:
            break
        state, cost = again, cost_again
    sd_m = float(np.clip(_rms(distances(problem, state)), LEAST_SD_M, MOST_SD_M))
    state, _ = solved(replace(problem, sd_m=sd_m), state, everything)
    root = RigidTransform.from_components(state.t, Rotation.from_matrix(state.R))
    off_m = distances(problem, state)
    return Pose(world_from_root=root, joint_angles=state.angles), off_m, _rms(off_m)


def _start(problem: Problem) -> State:
    """Find the trunk, then each limb from several starts."""
    model = problem.model
    names = [landmark.name for landmark in model.landmarks]
    core = np.array([name in CORE for name in names]) if set(CORE) <= set(names) else np.ones(len(names), bool)
    used = core & problem.is_given
    straight = State(np.eye(3), np.zeros(3), problem.prior)
    state = _aligned(straight, places(problem, straight)[used], problem.targets[used])
    if not set(CORE) <= set(names):
        return state
    trunk = replace(problem, targets=np.where(core[:, None], problem.targets, np.nan))
    state, _ = solved(trunk, state, _variables(model, set.union(*_core_chains(model)) - {0}))
    return _limbs(problem, state)


def _limbs(problem: Problem, state: State) -> State:
    """Turn each limb of a body that has them, one after the other."""
    landmarks = {landmark.name: landmark for landmark in problem.model.landmarks}
    for name in CORE if set(CORE) <= set(landmarks) else ():
        state = _limb(problem, state, problem.model.index_of(landmarks[name].segment))
    return state


def _limb(problem: Problem, state: State, top: int) -> State:
    """Turn the limb that begins with segment `top`, and what it hangs on beside the trunk; the rest is held.

    Of a grid over its first two joints, search from the best of each spin.
    """
    model = problem.model
    limb = _below(model, top)
    is_own = np.isin(problem.segments, limb)
    if not (problem.is_given & is_own).any():
        return state
    alone = replace(problem, targets=np.where(is_own[:, None], problem.targets, np.nan))
    girdle = [index for index in _chain(model, top)[:-1] if sum(index in chain for chain in _core_chains(model)) == 1]
    joints = np.array(limb[:2]) - 1
    low, high = np.moveaxis(problem.limits[joints].clip(-np.pi, np.pi), -1, 0)
    bend = int(np.argmax((high - low)[-1]))  # the axis about which a knee or an elbow turns most
    ranges = np.concatenate([np.stack([low, high], axis=-1)[0], [(low[-1, bend], high[-1, bend])]])
    x, y, z, b = np.meshgrid(*(start + _SHARES * (end - start) for start, end in ranges), indexing="ij")
    angles = np.broadcast_to(state.angles, (*x.shape, *state.angles.shape)).copy()
    angles[..., [index - 1 for index in girdle], :] = problem.prior[[index - 1 for index in girdle]]
    angles[..., joints[-1], bend] = b
    angles[..., joints[0], :] = np.stack([x, y, z], axis=-1)
    misfit = np.nansum(distances(alone, replace(state, angles=angles)) ** 2, axis=-1)
    starts = [state]
    for spin in range(len(_SHARES)):
        best = np.unravel_index(np.argmin(misfit[:, :, spin]), misfit[:, :, spin].shape)
        starts.append(replace(state, angles=angles[:, :, spin][best]))
    free = _variables(model, [*girdle, *limb], root=False)
    return min((solved(alone, start, free, COARSE) for start in starts), key=lambda found: found[1])[0]


def _rms(distance: Array) -> float:
    return float(np.sqrt(np.nanmean(distance**2)))


def _aligned(state: State, points: Array, targets: Array) -> State:
    """Move the whole body so that points (n, 3) lie nearest to targets (n, 3)."""
    R = Rotation.align_vectors(targets - targets.mean(axis=0), points - points.mean(axis=0))[0].as_matrix()
    return State(R @ state.R, targets.mean(axis=0) + R @ (state.t - points.mean(axis=0)), state.angles)


def _check(problem: Problem, names: list[str], *, has_start: bool) -> None:
    """Refuse targets that leave the root open."""
    given = [name for name, is_given in zip(names, problem.is_given, strict=True) if is_given]
    needed = CORE if set(CORE) <= set(names) else ()
    missing = [name for name in needed if name not in given]
    if missing and not has_start:
        raise BodyError(f"a pose needs both hips and both shoulders; not given: {', '.join(missing)}")
    spread = np.zeros(3) if len(given) < 3 else np.linalg.eigvalsh(np.cov(problem.targets[problem.is_given].T))
    if not given or (not has_start and spread[1] < LEAST_WIDTH_M**2):
        listed = ", ".join(given) or "none"
        raise BodyError(f"a pose of body '{problem.model.name}' needs three landmarks off a line; given: {listed}")


def _carriers(model: BodyModel, landmark: int) -> list[int]:
    """Return the segments in which a landmark is fixed: its own, and at the segment's origin the parent too."""
    own = model.index_of(model.landmarks[landmark].segment)
    at_origin = not np.any(model.landmarks[landmark].position_m) and own > 0
    return [own, int(model.parents[own])] if at_origin else [own]


def _core_chains(model: BodyModel) -> list[set[int]]:
    """Return the segments above each hip's and shoulder's joint, the root among them."""
    owners = {landmark.name: model.index_of(landmark.segment) for landmark in model.landmarks}
    return [{*_chain(model, owners[name])} - {owners[name]} for name in CORE]


def _chain(model: BodyModel, index: int) -> list[int]:
    """Return a segment's ancestors, the root first, and itself."""
    return [index] if index == 0 else [*_chain(model, int(model.parents[index])), index]


def _below(model: BodyModel, index: int) -> list[int]:
    """Return a segment and all that hang on it."""
    return [i for i in range(len(model.segments)) if index in _chain(model, i)]


def _variables(model: BodyModel, segments: Iterable[int], *, root: bool = True) -> NDArray[np.bool_]:
    """Mark the variables of the root and of some segments' joints: (6 + 3 joints,)."""
    free = np.zeros(6 + 3 * (len(model.segments) - 1), bool)
    free[:6] = root
    for index in segments:
        free[3 + 3 * index : 6 + 3 * index] = True
    return free


def _other_side(name: str) -> str:
    stem, _, side = name.rpartition("_")
    return {"left": f"{stem}_right", "right": f"{stem}_left"}.get(side, name)
