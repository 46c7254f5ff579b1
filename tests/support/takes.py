"""Takes made up for the tests of files for other programs."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Pose
from airborne.export.takes import Take, body_take, with_axis_markers
from airborne.motion import Motion, PlayersMotion, landmarks
from airborne.tracking import Estimate, Status
from tests.support.export_scenes import PERSON

NTSC = Fraction(60000, 1001)


def take_of(motion: Motion, model: BodyModel) -> Take:
    model = with_axis_markers(model)
    return body_take(motion, model, *landmarks(motion, model))


def tumbling(n=8, *, model=PERSON, lost=(), step=1, first=0, rate=NTSC, turns=2.0, seed=0) -> Motion:
    """Make a body that turns over and bends every joint, smoothly, with a small covariance."""
    rng, joints = np.random.default_rng(seed), tuple(segment.name for segment in model.segments[1:])
    far, phase = rng.uniform(-0.6, 0.6, (2, len(joints), 3))
    estimates = []
    for k in range(n):
        s = k / max(n - 1, 1)
        R = Rotation.from_euler("XYZ", [2 * np.pi * turns * s, 0.4 * np.sin(5 * s), 3 * s])
        pose = Pose(
            world_from_root=RigidTransform.from_components([1 + 0.5 * s, -2 + s, 1.5 + s - s * s], R),
            joint_angles=far * np.sin(4 * s + phase),
        )
        index = first + k * step
        estimate = Estimate(
            index=index,
            time_s=index / rate,
            status=Status.TRACKED,
            score=5.0,
            pose=pose,
            covariance=np.diag([4e-6] * 3 + [1e-5] * (3 + 3 * len(joints))),
            n_views=2,
        )
        if k in lost:
            estimate = replace(estimate, status=Status.LOST, score=np.nan, pose=None, covariance=None, n_views=0)
        estimates.append(estimate)
    return Motion.collect(estimates, joints)


def hidden(take: Take, rows, markers) -> Take:
    """Forget where some markers are in some frames."""
    points, sd = take.points.copy(), take.sd.copy()
    points[np.ix_(rows, markers)] = np.nan
    sd[np.ix_(rows, markers)] = np.nan
    return replace(take, points=points, sd=sd)


LEGS = ("hip_left", "hip_right", "knee_left", "knee_right", "ankle_left", "ankle_right", "foot_left", "foot_right")


def jumping(n=10, players=("Anna", "number 7"), *, lost=(), joints=(*LEGS, "torso"), seed=0) -> PlayersMotion:
    """Make players with legs of constant lengths that move at random, smoothly; in rows `lost` the last one is lost."""
    rng = np.random.default_rng(seed)
    points = np.full((n, len(players), 9, 3), np.nan)
    for p in range(len(players)):
        a, b = rng.uniform(-0.5, 0.5, (2, 16))
        for k in range(n):
            w = a + 0.3 * np.sin(6 * k / n + b)
            hips = Rotation.from_euler("ZY", [1.5 * p + w[0], 0.3 * w[1]])
            middle = np.array([p, w[2], 1 + 0.2 * w[3]])
            points[k, p, 8] = middle + hips.apply([0, 0.1 * w[4], 0.25])
            for side, sign in enumerate((1, -1)):
                v = w[5 + 5 * side : 10 + 5 * side]
                thigh = hips * Rotation.from_euler("XY", [v[0], v[1]])
                shank = thigh * Rotation.from_euler("XY", [abs(v[2]), 0.1 * v[3]])
                foot = shank * Rotation.from_euler("XZ", [v[4], 0.1])
                hip = middle + hips.apply([0.11 * sign, 0, 0])
                knee = hip + thigh.apply([0, 0, -0.45])
                ankle = knee + shank.apply([0, 0, -0.42])
                points[k, p, [side, 2 + side, 4 + side, 6 + side]] = (
                    hip,
                    knee,
                    ankle,
                    ankle + foot.apply([0, -0.17, 0]),
                )
    points[list(lost), -1] = np.nan
    at = [(*LEGS, "torso").index(name) for name in joints]
    is_lost = np.isnan(points[..., 0, 0])
    return PlayersMotion(
        index=np.arange(n),
        time_s=np.arange(n) / 60,
        rate=60.0,
        players=tuple(players),
        joints=tuple(joints),
        points=points[:, :, at],
        covariance=np.where(is_lost[..., None, None, None], np.nan, np.broadcast_to(1e-4 * np.eye(3), (len(at), 3, 3))),
        joint_status=np.where(is_lost[..., None].repeat(len(at), axis=-1), "lost", "tracked"),
        score=np.zeros((n, len(players))),
        n_views=np.full((n, len(players)), 3),
    )
