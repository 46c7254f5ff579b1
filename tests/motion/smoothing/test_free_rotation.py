"""In free flight the angular momentum is constant, so a pelvis that shakes against the trunk does not turn the body."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body.human import human18
from airborne.geometry.rotations import angles_from_matrix, geodesic, matrix_from_angles
from airborne.motion.smoothing import smoother
from airborne.motion.smoothing.settings import Smoothing
from airborne.motion.smoothing.smoother import smooth_root
from airborne.synthetic.flight.articulated import Takeoff, fly_articulated, joint_motion
from tests.support.motions import motion_of
from tests.support.tolerances import SOLVED

HUMAN, N, RATE = human18(1.75, 70.0), 40, 50
KALMAN = Smoothing(method="kalman")
COVARIANCE = 1e-4 * np.eye(6 + 3 * HUMAN.n_joints)
TORSO = [segment.name for segment in HUMAN.segments].index("torso") - 1


def flight(bend=0.6, lost=()):
    """A somersault in which the arms go down, its true angular velocities, and its motion as if tracked exactly."""
    first, last = np.zeros((2, HUMAN.n_joints, 3))
    arms = [segment.name.startswith("upper_arm") for segment in HUMAN.segments[1:]]
    first[arms] = [-bend, 0, 0]
    takeoff = Takeoff(
        centre=np.ones(3), velocity=np.array([0, -1.0, 3]), R=np.eye(3), angular_momentum=np.array([60.0, 4.0, -3.0])
    )
    joints = joint_motion(np.array([0.05, 0.6]), np.stack([first, last]))
    flown = fly_articulated(HUMAN, takeoff, joints, np.arange(N) / RATE)
    world_velocity = np.einsum("nij,nj->ni", flown.R, flown.angular_velocity)
    motion = motion_of(HUMAN, [flown.pose(k) for k in range(N)], RATE, COVARIANCE, lost)
    return world_velocity, motion


def shake_pelvis(motion, sd_rad=0.05):
    """Turn the pelvis to and fro against the trunk, three frames alike."""
    rng = np.random.default_rng(3)
    shakes = np.repeat(rng.normal(scale=sd_rad, size=(N // 3 + 1, 3)), 3, axis=0)[:N]
    turn = Rotation.from_rotvec(np.apply_along_axis(np.convolve, 0, shakes, np.ones(3) / 3, "same")).as_matrix()
    angles = motion.joint_angles.copy()
    torso = turn.swapaxes(1, 2) @ matrix_from_angles(angles[:, TORSO])
    angles[:, TORSO] = angles_from_matrix(torso)
    return replace(motion, R=motion.R @ turn, joint_angles=angles)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_a_rigid_flight_is_followed_exactly():
    velocity, motion = flight(bend=0.0)
    result = smooth_root(motion, HUMAN, KALMAN, [])
    np.testing.assert_allclose(result["angular_velocity"].to_numpy(), velocity, atol=10 * SOLVED)
    assert "constant angular momentum" in result.attrs["history"][-1]


def test_a_shaking_pelvis_does_not_turn_the_body():
    velocity, true = flight()
    motion = shake_pelvis(true)
    result = smooth_root(motion, HUMAN, KALMAN, [])
    filtered = smooth_root(motion, HUMAN, Smoothing(method="butterworth", cutoff_hz=6), [])
    errors = {
        name: rms((each["angular_velocity"].to_numpy() - velocity)[2:-2])
        for name, each in (("conserved", result), ("filtered", filtered))
    }
    assert errors["conserved"] < 0.4 * errors["filtered"]
    R = Rotation.from_quat(result["quaternion"].to_numpy()).as_matrix()
    assert geodesic(R, true.R).mean() < 0.6 * geodesic(motion.R, true.R).mean()


def test_lost_frames_are_filled_by_the_flight():
    velocity, motion = flight(lost=(18, 19))
    result = smooth_root(motion, HUMAN, replace(KALMAN, fill_s=0.1), [])
    assert rms(result["angular_velocity"].to_numpy() - velocity) < 0.15


@pytest.mark.parametrize("why", ["stands", "is turned by a torque", "has no joints"])
def test_who_does_not_turn_freely_is_smoothed_as_others_are(why, monkeypatch):
    _, motion = flight()
    if why == "stands":
        motion = replace(motion, R=np.tile(np.eye(3), (N, 1, 1)), position=np.ones((N, 3)))
    elif why == "has no joints":
        motion = replace(motion, joints=())
    else:
        spin = np.outer(30 * (np.arange(N) / RATE) ** 2, [0, 0, 1.0])
        motion = replace(motion, R=Rotation.from_rotvec(spin).as_matrix() @ motion.R)
    result = smooth_root(motion, HUMAN, KALMAN, [])["angular_velocity"].to_numpy()
    monkeypatch.setattr(smoother, "conserve_momentum", lambda rotations, motion, model: rotations)
    np.testing.assert_array_equal(result, smooth_root(motion, HUMAN, KALMAN, [])["angular_velocity"])
