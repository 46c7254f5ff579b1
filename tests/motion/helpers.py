"""Runs made up for the tests."""

from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.tracking import Estimate, Status


def estimate(index, *, seed=0, n_joints=0, covariance=True, status=Status.TRACKED):
    """Make an estimate with numbers that need all their digits; a lost one holds none."""
    rng = np.random.default_rng([seed, index])
    is_lost = status is Status.LOST
    root = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    spread = rng.normal(size=(6, 6)) * 1e-2
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
