"""A person draws up the legs in flight: the pelvis falls faster than the centre of mass, and nothing is wrong."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.cameras import Rig
from airborne.constants import GRAVITY_M_S2
from airborne.tracking.self_check.causes import name_causes
from airborne.tracking.self_check.check import gather_equations
from airborne.tracking.self_check.nuisances import MEASURED_SD, nuisances_of
from airborne.tracking.self_check.path import TrackedPath
from tests.support.people import HUMAN, PLACE, THREE, UPRIGHT, person, turned_to

INDICES = range(0, 60, 5)
MIDDLE_S = Fraction(INDICES[-1], 2 * 50)
FALLS_M_S2 = 1.2 * GRAVITY_M_S2
limbs_at = turned_to(UPRIGHT)


def tucking(time_s: Fraction):
    t = float(time_s - MIDDLE_S)
    pose = limbs_at(time_s)
    at = PLACE + np.array([0.5 * t, 0.2 * t, 0.9 - FALLS_M_S2 * t**2 / 2])
    return replace(pose, world_from_root=RigidTransform.from_components(at, pose.world_from_root.rotation))


def test_no_size_is_said_to_be_wrong():
    scene, rig = person(tucking), Rig(THREE)
    frames = [scene.frames(index) for index in INDICES]
    time_s, poses = [each.time_s for each in frames], [scene.start(index) for index in INDICES]
    covariances = np.tile(np.diag([2e-3] * 3 + [1e-2] * 3) ** 2, (len(poses), 1, 1))
    path = TrackedPath(np.array(INDICES), np.array(time_s, float), poses, covariances)
    run = gather_equations(HUMAN, rig, path, frames, body_sd=MEASURED_SD)
    assert run is not None and run.says_causes
    assert not name_causes(run.solution, nuisances_of(rig), run.prior).has_alarm
