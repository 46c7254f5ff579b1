"""Motions made from a truth, with errors put in."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Part, Pose, Segment
from airborne.evaluation import Truth
from airborne.motion import Motion
from airborne.tracking import Estimate, Status

IDENTITY = [np.eye(3)]
HALF_TURN = [np.eye(3), np.diag([-1.0, 1.0, -1.0])]
YELLOW = np.array([231.0, 200.0, 48.0])


def cross():
    parts = (
        Part("long_bar", Box(np.array([0.06, 0.9, 0.045])), RigidTransform.identity(), YELLOW),
        Part("short_bar", Box(np.array([0.6, 0.06, 0.045])), RigidTransform.from_translation([0, 0.18, 0]), YELLOW),
    )
    return BodyModel("cross", (Segment("cross", None, np.zeros(3), parts),))


def flight(n=40, period_s=0.02):
    """Make the truth of a steady somersault with some tilt."""
    phase = np.linspace(0, 2 * np.pi, n)
    angles = np.stack([phase, 0.2 * np.sin(phase), 0.5 * phase], axis=-1)
    return Truth(
        index=np.arange(n),
        time_s=np.arange(n) * period_s,
        position=np.stack([0.1 * phase, 0 * phase, 1 + np.sin(phase)], axis=-1),
        R=Rotation.from_euler("XYZ", angles).as_matrix(),
    )


def motion_of(truth, *, covariance=None, lost=(), uncertain=()):
    """Make the motion that finds the truth exactly."""
    estimates = []
    for i, (index, time_s) in enumerate(zip(truth.index, truth.time_s, strict=True)):
        is_lost = i in lost
        root = RigidTransform.from_components(truth.position[i], Rotation.from_matrix(truth.R[i]))
        status = Status.LOST if is_lost else Status.UNCERTAIN if i in uncertain else Status.TRACKED
        estimates.append(
            Estimate(
                index=int(index),
                time_s=Fraction(float(time_s)).limit_denominator(10**9),
                status=status,
                score=np.nan if is_lost else 10.0,
                pose=None if is_lost else Pose(world_from_root=root),
                covariance=None if is_lost else covariance,
                n_views=3,
            )
        )
    return Motion.collect(estimates)


def shifted(motion, metres):
    return replace(motion, position=motion.position + metres)


def turned(motion, world_rotation_vectors):
    return replace(motion, R=Rotation.from_rotvec(world_rotation_vectors).as_matrix() @ motion.R)
