"""Small clips with truth: a person of 18 segments in the air, moving arms and legs, about 140 px tall."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose, human18
from airborne.body.chain import clamp_to_limits, move_pose
from airborne.tracking import Estimate
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import Tracker
from tests.support.scenes import TURNS, Scene, camera

HUMAN = human18()
FOCAL_PX, REACH = 310.0, 0.36
PLACE = np.array([0.0, 0.0, 1.45])
CAMERAS = tuple(camera(f"cam{i}", turn, FOCAL_PX) for i, turn in enumerate(TURNS))
THREE = CAMERAS[:3]

# joint angles, and how they swing [rad]; joints not named stay straight
_HELD = {
    "torso": (0.1, 0.05, 0.0),
    "chest": (0.05, 0.0, 0.1),
    "head": (-0.1, 0.0, 0.1),
    "upper_arm_left": (-0.5, -0.6, 0.0),
    "forearm_left": (-0.9, 0.0, 0.0),
    "upper_arm_right": (0.1, 0.9, 0.0),
    "forearm_right": (-0.5, 0.0, 0.0),
    "thigh_left": (-0.7, -0.2, 0.0),
    "shank_left": (0.8, 0.0, 0.0),
    "thigh_right": (-0.1, 0.2, 0.0),
    "shank_right": (0.4, 0.0, 0.0),
    "foot_left": (0.3, 0.0, 0.0),
    "foot_right": (0.3, 0.0, 0.0),
}
_SWING = {
    "torso": (0.2, 0.0, 0.1),
    "upper_arm_left": (-1.0, -0.4, 0.0),
    "forearm_left": (-0.6, 0.0, 0.0),
    "upper_arm_right": (-0.8, 0.5, 0.0),
    "forearm_right": (-0.6, 0.0, 0.0),
    "thigh_left": (-0.6, 0.0, 0.0),
    "shank_left": (0.7, 0.0, 0.0),
    "thigh_right": (-0.5, 0.0, 0.0),
    "shank_right": (0.6, 0.0, 0.0),
}


def angles_of(named: dict[str, tuple[float, float, float]], model: BodyModel = HUMAN) -> np.ndarray:
    """Joint angles (joints, 3) [rad] by the names of the segments; zero for the others."""
    return np.array([named.get(segment.name, (0.0, 0.0, 0.0)) for segment in model.segments[1:]])


HELD, SWING = angles_of(_HELD), angles_of(_SWING)


def turned_to(turn: Rotation, **held: tuple[float, float, float]) -> Callable[[Fraction], Pose]:
    """A motion: arms and legs swing, the body turns slowly from an orientation; some joints held elsewhere."""

    def motion(time_s: Fraction) -> Pose:
        t = float(time_s)
        angles = HELD + SWING * np.sin(4 * t)
        for name, xyz in held.items():
            angles[HUMAN.index_of(name) - 1] = xyz
        turned = Rotation.from_rotvec([0.6 * t, 0.3 * t, 1.2 * t]) * turn
        root = RigidTransform.from_components(PLACE + np.array([0.5, 0.2, 0.6]) * t, turned)
        return clamp_to_limits(HUMAN, Pose(world_from_root=root, joint_angles=angles))

    return motion


UPRIGHT = Rotation.from_euler("XYZ", [0.1, 0.05, 0.3])
swinging = turned_to(UPRIGHT)


def person(motion: Callable[[Fraction], Pose | None] = swinging, cameras: Sequence = THREE, **changes) -> Scene:
    return replace(Scene(HUMAN, motion, cameras, reach=REACH), **changes)


def wrong(pose: Pose, *, off_m: float = 0.025, off_deg: float = 3.0, seed: int = 0, model: BodyModel = HUMAN) -> Pose:
    """A pose that is wrong by a length and, in the root and in every joint, by an angle about some axis."""
    axes = np.random.default_rng(seed).normal(size=(len(model.segments) + 1, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    sizes = np.append(off_m, np.full(len(model.segments), np.radians(off_deg)))
    return clamp_to_limits(model, move_pose(pose, (sizes[:, None] * axes).ravel()))


def tracker(scene: Scene, start: Pose | None = None, model: BodyModel | None = None, **settings) -> Tracker:
    return tracker_of(Settings(**settings), model or scene.model, start or wrong(scene.start()))


def landmark_errors_mm(scene: Scene, estimate: Estimate, model: BodyModel | None = None) -> np.ndarray:
    """How far each landmark of an estimate is from the truth: (landmarks,) [mm]."""
    truth = scene.motion(estimate.time_s)
    assert truth is not None and estimate.pose is not None
    found, true = (model or scene.model).with_pose(estimate.pose), scene.model.with_pose(truth)
    return 1000 * np.linalg.norm(found.landmarks - true.landmarks, axis=1)


def mean_errors_mm(scene: Scene, estimates: Sequence[Estimate], model: BodyModel | None = None) -> np.ndarray:
    """The mean landmark error of each estimate that has a pose: [mm]."""
    found = [landmark_errors_mm(scene, estimate, model).mean() for estimate in estimates if estimate.pose is not None]
    return np.array(found)


def sd_rad(estimate: Estimate, segment: str, model: BodyModel = HUMAN) -> np.ndarray:
    """How sure the joint of a segment is about its three axes: (3,) [rad]."""
    assert estimate.covariance is not None
    first = 3 + 3 * model.index_of(segment)
    return np.sqrt(np.diag(estimate.covariance)[first : first + 3])
