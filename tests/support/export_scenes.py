"""A body before cameras, and a run of it, made up for the tests."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Part, Pose, Segment, human18
from airborne.cameras import Camera, Rig
from airborne.motion import Motion
from airborne.tracking import Estimate, Status
from airborne.video import Frames, View

SIZE = (320, 240)
SCENE_GREY = 120
HALF_TURN = np.diag([-1.0, 1.0, -1.0])  # about y, under which a box looks the same


def body(shape):
    part = Part("solid", shape, RigidTransform.identity(), np.array([200.0, 40.0, 40.0]))
    return BodyModel("one solid", (Segment("root", None, np.zeros(3), (part,)),))


BOX = body(Box(np.array([0.5, 0.3, 0.2])))
PERSON = human18(1.7, 65.0)
BALL = body(Ellipsoid(np.full(3, 0.25)))


def camera(name="cam1", *, distance_m=4.0, size=SIZE):
    """Make a camera that looks along +y at the world's origin, z up."""
    K = np.array([[400.0, 0, size[0] / 2], [0, 400.0, size[1] / 2], [0, 0, 1]])
    turn = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    return Camera(name=name, K=K, size=size, camera_from_world=RigidTransform.from_components([0, 0, distance_m], turn))


RIG = Rig((camera("cam1"), camera("cam2", distance_m=6.0)))


def frames(index=0, *, rig=RIG, missing=()):
    views = [View(c, np.full((c.size[1], c.size[0], 3), SCENE_GREY, np.uint8)) for c in rig]
    return Frames(index, Fraction(index, 50), tuple(None if i in missing else view for i, view in enumerate(views)))


def pose(position=(0.0, 0.0, 0.0), R=None):
    turn = Rotation.from_matrix(np.eye(3) if R is None else R)
    return Pose(world_from_root=RigidTransform.from_components(position, turn))


def posed(model=BOX, position=(0.0, 0.0, 0.0)):
    return model.with_pose(pose(position))


def run(n=20, *, lost=(), uncertain=(), unseen=(), turns=1.0):
    """Make a steady twisting somersault at 50 Hz; frames in `unseen` have an infinite rotation variance."""
    estimates = []
    for i, phase in enumerate(np.linspace(0, 2 * np.pi, n)):
        R = Rotation.from_euler("XYZ", [turns * phase, 0.3 * np.sin(phase), phase / 2]).as_matrix()
        covariance = np.diag([4e-6, 4e-6, 4e-6, 1e-4, 1e-4, 1e-4])
        if i in unseen:
            covariance[4, 4] = np.inf
        estimate = Estimate(
            index=i,
            time_s=Fraction(i, 50),
            status=Status.UNCERTAIN if i in uncertain else Status.TRACKED,
            score=10.0 + i,
            pose=pose((0.1 * i, 0.0, 1.0), R),
            covariance=covariance,
            n_views=2,
        )
        if i in lost:
            estimate = replace(estimate, status=Status.LOST, score=np.nan, pose=None, covariance=None, n_views=0)
        estimates.append(estimate)
    return Motion.collect(estimates)


def person_run(n=12, *, lost=(), unseen=(), bent=1.0, raised=0.0):
    """Make a run of a person who falls and bends the left knee and elbow, evenly, at 50 Hz.

    The left arm is `raised` sideways [rad]. In frames `unseen` the left elbow's turns have an infinite variance.
    """
    joints = [segment.name for segment in PERSON.segments[1:]]
    estimates = []
    for i in range(n):
        angles = np.zeros((len(joints), 3))
        angles[joints.index("shank_left"), 0] = bent * 0.05 * i
        angles[joints.index("forearm_left"), 0] = -bent * 0.05 * i
        angles[joints.index("upper_arm_left"), 1] = -raised
        covariance = np.diag([4e-6] * 3 + [1e-4] * (3 + angles.size))
        if i in unseen:
            hidden = 6 + 3 * joints.index("forearm_left") + np.arange(3)
            covariance[hidden, hidden] = np.inf
        estimate = Estimate(
            index=i,
            time_s=Fraction(i, 50),
            status=Status.TRACKED,
            score=10.0,
            pose=replace(pose((0.0, 0.0, 2.0 - 4.905 * (i / 50) ** 2)), joint_angles=angles),
            covariance=covariance,
            n_views=2,
        )
        if i in lost:
            estimate = replace(estimate, status=Status.LOST, score=np.nan, pose=None, covariance=None, n_views=0)
        estimates.append(estimate)
    return Motion.collect(estimates, tuple(joints))
