"""Runs made up for the tests."""

from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Ellipsoid, Inertia, Landmark, Part, Pose, Segment
from airborne.body.chain import move_pose
from airborne.motion import Motion
from airborne.tracking import Estimate, Status


def estimate(index, *, seed=0, n_joints=0, covariance=True, status=Status.TRACKED):
    """Make an estimate with numbers that need all their digits; a lost one holds none."""
    rng = np.random.default_rng([seed, index])
    is_lost = status is Status.LOST
    root = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    spread = rng.normal(size=(6 + 3 * n_joints,) * 2) * 1e-2
    square = spread @ spread.T
    return Estimate(
        index=index,
        time_s=Fraction(1001 * index, 60000),
        status=status,
        score=np.nan if is_lost else float(rng.uniform(5, 30)),
        pose=None if is_lost else Pose(world_from_root=root, joint_angles=rng.normal(size=(n_joints, 3))),
        covariance=(square + square.T) / 2 if covariance and not is_lost else None,
        n_views=0 if is_lost else 3,
    )


def run_with_gap(n=8, lost=(3, 4), **kwargs):
    return [estimate(i, status=Status.LOST if i in lost else Status.TRACKED, **kwargs) for i in range(n)]


def somersault(n=30, *, turns=1.0, twist_turns=0.5, variance=(1e-6, 1e-4)):
    """Make a steady twisting somersault at 50 Hz with independent, equal variances [m^2, rad^2]."""
    phase = np.linspace(0, 2 * np.pi, n)
    angles = np.stack([turns * phase, 0.1 * np.sin(phase), twist_turns * phase], axis=-1)
    covariance = np.diag(np.repeat(variance, 3)).astype(float)
    return [
        Estimate(
            index=i,
            time_s=Fraction(i, 50),
            status=Status.TRACKED,
            score=10.0,
            pose=Pose(
                world_from_root=RigidTransform.from_components(
                    [0.1 * i, 0.0, 1.0], Rotation.from_euler("XYZ", angles[i])
                )
            ),
            covariance=covariance,
            n_views=3,
        )
        for i in range(n)
    ], angles


def figure(seed=5):
    """Make a body of five segments, each with a mass, a landmark, and a joint off the axes."""
    rng = np.random.default_rng(seed)
    part = (Part("part", Ellipsoid(np.full(3, 0.1)), RigidTransform.identity(), None),)
    parents = {"trunk": None, "head": "trunk", "arm": "trunk", "hand": "arm", "leg": "trunk"}
    segments, marks = [], []
    for name, parent in parents.items():
        mass, turn = rng.uniform(1, 20), Rotation.random(rng=rng).as_matrix()
        tensor = turn @ np.diag(mass * np.array([0.03, 0.025, 0.01])) @ turn.T
        inertia = Inertia(mass, rng.uniform(-0.2, 0.2, 3), (tensor + tensor.T) / 2)
        segments.append(Segment(name, parent, rng.uniform(-0.4, 0.4, 3), part, inertia=inertia))
        marks.append(Landmark(f"{name}_mark", name, rng.uniform(-0.3, 0.3, 3)))
    return BodyModel("figure", tuple(segments), tuple(marks))


def motion_of(model, poses, rate_hz=50, covariance=None, lost=()):
    """Make the motion that finds exactly these poses, those of the frames `lost` apart."""
    joints = tuple(segment.name for segment in model.segments[1:])
    estimates = [
        Estimate(
            index=k,
            time_s=Fraction(k, rate_hz),
            status=Status.LOST if k in lost else Status.TRACKED,
            score=np.nan if k in lost else 10.0,
            pose=None if k in lost else pose,
            covariance=None if k in lost else covariance,
            n_views=3,
        )
        for k, pose in enumerate(poses)
    ]
    return Motion.collect(estimates, joints)


def small_covariance(model, sd=1e-3, seed=0):
    """Make a covariance of a body's whole motion vector with all its correlations."""
    size = 6 + 3 * (len(model.segments) - 1)
    spread = np.random.default_rng(seed).normal(size=(size, size)) * sd / size**0.5
    return spread @ spread.T


def shaken(rng, pose, covariance):
    """Draw a pose whose errors have this covariance."""
    return move_pose(pose, rng.multivariate_normal(np.zeros(len(covariance)), covariance, method="cholesky"))


def swinging(model, time_s, seed=0):
    """Return poses that turn, travel and swing smoothly at the times."""
    rng = np.random.default_rng(seed)
    n = len(model.segments) - 1
    rate, phase, size = rng.uniform(3, 6, (n, 3)), rng.uniform(0, 6, (n, 3)), rng.uniform(0.1, 0.5, (n, 3))
    return [
        Pose(
            world_from_root=RigidTransform.from_components(
                [0.5 * t, -t, 1 + 4 * t - 4.905 * t**2], Rotation.from_rotvec([5 * t, 0.3 * np.sin(4 * t), 2 * t])
            ),
            joint_angles=size * np.sin(rate * t + phase),
        )
        for t in time_s
    ]
