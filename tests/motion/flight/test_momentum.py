"""Momentum is that of the masses in motion, and constant where nothing acts on the body."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Inertia, Pose, Segment
from airborne.body.human import human18
from airborne.motion import flight_summary, measure_flight
from airborne.motion.flight.momentum import angular_momenta, angular_momentum, centre_of_mass
from airborne.synthetic.flight.articulated import Takeoff, fly_articulated, joint_motion
from tests.support.motions import figure, motion_of, shaken, small_covariance, swinging
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED, sampled

MODEL = figure()


def particles(model, pose):
    """Masses (m,) and places (m, 3) of point masses with the same inertias: two on each axis of each segment."""
    posed, mass, place = model.with_pose(pose), [], []
    for segment, R, t in zip(model.segments, posed.R, posed.t, strict=True):
        inertia = segment.inertia
        moments, axes = np.linalg.eigh(inertia.tensor_kg_m2)
        second = moments.sum() / 2 - moments  # integrals of x^2, y^2, z^2 over the mass
        for axis, value in zip(axes.T, second, strict=True):
            for sign in (1, -1):
                mass.append(inertia.mass_kg / 6)
                place.append(R @ (inertia.centre_m + sign * axis * np.sqrt(3 * value / inertia.mass_kg)) + t)
    return np.array(mass), np.array(place)


def momentum_of_particles(model, poses, step_s):
    """Angular momentum about the centre of mass, by central differences between three poses."""
    (mass, before), (_, now), (_, after) = (particles(model, pose) for pose in poses)
    velocity = (after - before) / (2 * step_s)
    return np.sum(mass[:, None] * np.cross(now - mass @ now / mass.sum(), velocity), axis=0)


def sd_of_poses(motion):
    """Deviations of the momentum by the poses alone."""
    return np.sqrt(angular_momenta(motion, MODEL, inertia_sd=0)[1])


def spun(model, momentum, duration_s, n):
    """Poses of a rigid body in free rotation with a momentum (3,), by Euler's equations."""
    tensor = model.segments[0].inertia.tensor_kg_m2

    def change(_, state):
        R = state.reshape(3, 3)
        x, y, z = np.linalg.solve(tensor, R.T @ momentum)
        return (R @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).ravel()

    times = np.linspace(0, duration_s, n)
    result = solve_ivp(change, (0, duration_s), np.eye(3).ravel(), t_eval=times, rtol=1e-10, atol=1e-12).y.T
    return [
        Pose(world_from_root=RigidTransform.from_components([t, 0, 1], Rotation.from_matrix(R)))
        for t, R in zip(times, result.reshape(-1, 3, 3), strict=True)
    ]


def plank(tensor=(10.0, 10.5, 0.6)):
    part = MODEL.segments[0].parts
    inertia = Inertia(60.0, np.array([0.1, -0.05, 0.2]), np.diag(tensor))
    return BodyModel("plank", (Segment("plank", None, np.zeros(3), part, inertia=inertia),))


def test_centre_of_mass_is_that_of_the_particles():
    (pose,) = swinging(MODEL, [0.3])
    mass, place = particles(MODEL, pose)
    np.testing.assert_allclose(centre_of_mass(MODEL.with_pose(pose))[0], mass @ place / mass.sum(), atol=EXACT)


def test_momentum_is_that_of_the_particles():
    step = 1e-4
    poses = swinging(MODEL, 0.2 + step * np.arange(-2, 3))
    result, _ = angular_momenta(motion_of(MODEL, poses, rate_hz=10_000), MODEL)
    expected = momentum_of_particles(MODEL, poses[1:4], step)
    np.testing.assert_allclose(result[2], expected, rtol=1e-5)


def test_momentum_of_a_steady_rotation_is_inertia_times_rate_at_any_frame_rate():
    model, rate = plank(), 9.0
    poses = [
        Pose(world_from_root=RigidTransform.from_components([0, k, 0], Rotation.from_rotvec([rate * k / 25, 0, 0])))
        for k in range(7)
    ]
    result, _ = angular_momenta(motion_of(model, poses, rate_hz=25), model)
    np.testing.assert_allclose(result, np.tile([90.0, 0, 0], (7, 1)), atol=100 * ROUNDTRIP)


def test_momentum_of_a_free_twisting_somersault_is_constant():
    model, momentum = plank(), np.array([85.0, 3.0, -2.0])
    tumbling = spun(model, momentum, 0.8, 41)
    turned = tumbling[0].world_from_root.rotation.inv() * tumbling[-1].world_from_root.rotation
    assert turned.magnitude() > 1
    result, _ = angular_momenta(motion_of(model, tumbling, rate_hz=50), model)
    np.testing.assert_allclose(result[2:-2], np.tile(momentum, (37, 1)), atol=0.01 * 85)
    finer, _ = angular_momenta(motion_of(model, spun(model, momentum, 0.8, 161), rate_hz=200), model)
    np.testing.assert_allclose(finer[2:-2], np.tile(momentum, (157, 1)), atol=0.01 * 85 / 16)


def test_measured_momentum_of_a_simulated_flight_with_moving_arms_is_the_simulations():
    model, momentum = human18(), np.array([60.0, 0.0, 0.0])
    arms = [model.index_of(f"upper_arm_{side}") - 1 for side in ("left", "right")]
    angles = np.zeros((2, len(model.segments) - 1, 3))
    angles[:, arms, 1] = [[-2.0, 1.2], [-0.2, 0.2]]
    start = Takeoff(centre=np.ones(3), velocity=np.array([0, -1.0, 3]), R=np.eye(3), angular_momentum=momentum)
    flown = fly_articulated(model, start, joint_motion(np.array([0.05, 0.3]), angles), np.arange(21) / 50)
    motion = motion_of(model, [flown.pose(k) for k in range(21)])
    np.testing.assert_allclose(angular_momenta(motion, model)[0], np.tile(momentum, (21, 1)), atol=0.01 * 60)
    summary = flight_summary(motion, measure_flight(motion, model))
    assert summary.fitted_gravity_m_s2 == pytest.approx(9.81, abs=SOLVED)
    assert summary.ballistic_rms_mm < 1e3 * ROUNDTRIP


def test_momentum_rotates_with_the_world_and_does_not_depend_on_position():
    world = RigidTransform.from_components([3.0, -2.0, 1.0], Rotation.from_rotvec([0.3, 1.0, -0.4]))
    poses = swinging(MODEL, np.arange(6) / 50)
    moved = [Pose(world_from_root=world * pose.world_from_root, joint_angles=pose.joint_angles) for pose in poses]
    result, _ = angular_momenta(motion_of(MODEL, poses), MODEL)
    np.testing.assert_allclose(
        angular_momenta(motion_of(MODEL, moved), MODEL)[0], world.rotation.apply(result), atol=ROUNDTRIP
    )


def test_momentum_is_linear_in_the_rates():
    R, rng = MODEL.with_pose(swinging(MODEL, [0.2])[0]).R, np.random.default_rng(0)
    a, b = rng.normal(size=(2, 4, 1, len(R), 3))
    both = angular_momentum(MODEL, R, 2 * a + b)
    np.testing.assert_allclose(both, 2 * angular_momentum(MODEL, R, a) + angular_momentum(MODEL, R, b), atol=ROUNDTRIP)
    assert both.shape == (4, 1, 3)


def test_momentum_deviations_are_those_of_sampled_poses():
    rng, covariance, n = np.random.default_rng(4), small_covariance(MODEL, sd=3e-3), 300
    poses = swinging(MODEL, np.arange(8) / 50)
    runs = [[shaken(rng, pose, covariance) for pose in poses] for _ in range(n)]
    values = [angular_momenta(motion_of(MODEL, run), MODEL)[0] for run in runs]
    stated = [sd_of_poses(motion_of(MODEL, run, covariance=covariance)) ** 2 for run in runs[:20]]
    sd = np.sqrt(np.mean(stated, axis=0))
    np.testing.assert_allclose(sd, np.std(values, axis=0), rtol=sampled(n))  # at the ends and inside


def test_errors_of_joints_that_stay_the_same_hardly_widen_the_momentum():
    covariance, poses = small_covariance(MODEL, sd=3e-3), swinging(MODEL, np.arange(60) / 200)
    joints_alone = np.where(np.arange(len(covariance)) < 6, 1e-6, 1.0)
    covariance = covariance * np.outer(joints_alone, joints_alone)
    off = [shaken(np.random.default_rng(4), pose, covariance) for pose in poses]  # all by the same
    same = motion_of(MODEL, off, rate_hz=200, covariance=covariance)
    (value, _), sd = angular_momenta(same, MODEL), sd_of_poses(same)
    exact, _ = angular_momenta(motion_of(MODEL, poses, rate_hz=200), MODEL)
    shaken_apart = [shaken(rng, pose, covariance) for rng in [np.random.default_rng(5)] for pose in poses]
    apart = sd_of_poses(motion_of(MODEL, shaken_apart, rate_hz=200, covariance=covariance))
    assert np.mean(np.abs(value - exact) < 2 * sd) > 0.85
    assert np.median(sd) < 0.3 * np.median(apart)


def test_joint_that_two_frames_do_not_show_goes_on_as_smoothly_as_in_the_others():
    poses, covariance = swinging(MODEL, np.arange(20) / 50), small_covariance(MODEL)
    motion = motion_of(MODEL, poses, covariance=covariance)
    hidden = motion.covariance.copy()
    hidden[9:11, 6:9] = hidden[9:11, :, 6:9] = 0
    hidden[9:11, [6, 7, 8], [6, 7, 8]] = np.inf
    shown_sd, hidden_sd = (sd_of_poses(replace(motion, covariance=each)) for each in (motion.covariance, hidden))
    beside = [7, 8, 11, 12]
    assert np.median(hidden_sd[beside]) < 3 * np.median(shown_sd[beside])


def test_momentum_never_reaches_across_a_lost_frame():
    poses = swinging(MODEL, np.arange(9) / 50)
    result, _ = angular_momenta(motion_of(MODEL, poses, lost=[4]), MODEL)
    first, _ = angular_momenta(motion_of(MODEL, poses[:4]), MODEL)
    np.testing.assert_allclose(result[:4], first, atol=EXACT * 1e3)
    assert np.isnan(result[4]).all()


def test_single_frame_between_lost_ones_has_no_momentum():
    result, variance = angular_momenta(motion_of(MODEL, swinging(MODEL, np.arange(3) / 50), lost=[0, 2]), MODEL)
    assert np.isnan(result).all()
    assert np.isnan(variance).all()


def test_two_frames_give_the_mean_rate_between_them():
    model = plank()
    poses = [Pose(world_from_root=RigidTransform.from_rotation(Rotation.from_rotvec([0, a, 0]))) for a in (0.0, 0.2)]
    result, _ = angular_momenta(motion_of(model, poses, rate_hz=50), model)
    np.testing.assert_allclose(result, np.tile([0, 105.0, 0], (2, 1)), atol=100 * ROUNDTRIP)


def test_a_joint_that_jumps_right_round_breaks_the_fit_off():
    poses = swinging(MODEL, np.arange(8) / 50)
    for pose in poses[4:]:
        pose.joint_angles[0, 2] += 2.8
    result, _ = angular_momenta(motion_of(MODEL, poses), MODEL)
    before, _ = angular_momenta(motion_of(MODEL, poses[:4]), MODEL)
    np.testing.assert_allclose(result[:4], before, atol=0.02 * np.linalg.norm(before[0]))


def test_unobserved_rotation_of_a_joint_widens_the_momentum_and_leaves_it_finite():
    covariance = small_covariance(MODEL)
    wide = covariance.copy()
    wide[6] = wide[:, 6] = 0
    wide[6, 6] = np.inf
    poses = swinging(MODEL, np.arange(5) / 50)
    narrow_sd, wide_sd = (sd_of_poses(motion_of(MODEL, poses, covariance=each)) for each in (covariance, wide))
    assert np.isfinite(wide_sd).all()
    assert (wide_sd > 10 * narrow_sd).any()


def test_momentum_deviations_are_those_of_sampled_inertias():
    trunk, *limbs = MODEL.segments
    named = zip(limbs, ("arm_left", "arm_right", "hand", "leg"), strict=True)
    limbs = [replace(segment, name=name, parent="trunk") for segment, name in named]
    model = replace(MODEL, segments=(trunk, *limbs), landmarks=())
    rng, n, sd = np.random.default_rng(6), 400, 0.1
    poses = swinging(model, np.arange(5) / 50)
    motion, without_sd = (motion_of(model, poses, covariance=each) for each in (1e-16 * np.eye(model.n_dofs), None))

    def sample():
        kinds = 1 + sd * rng.standard_normal(4)[[0, 1, 1, 2, 3]]  # both arms are wrong alike
        mass = [each.inertia.mass_kg for each in model.segments]
        factors = kinds * np.sum(mass) / (kinds @ mass)  # the whole mass is known
        inertias = [
            Inertia(f * own.mass_kg, own.centre_m, f * own.tensor_kg_m2)
            for f, own in zip(factors, (each.inertia for each in model.segments), strict=True)
        ]
        changed = [replace(each, inertia=own) for each, own in zip(model.segments, inertias, strict=True)]
        return angular_momenta(without_sd, replace(model, segments=tuple(changed)))[0]

    stated = np.sqrt(angular_momenta(motion, model, inertia_sd=sd)[1])
    np.testing.assert_allclose(stated, np.std([sample() for _ in range(n)], axis=0), rtol=sampled(n) + sd)


def test_a_rigid_bodys_momentum_is_as_sure_as_its_rotation():
    model = plank()
    motion = motion_of(model, spun(model, np.array([20.0, 5.0, 0.5]), 0.2, 11), covariance=1e-6 * np.eye(6))
    values = [angular_momenta(motion, model, inertia_sd=sd)[1] for sd in (0.0, 0.5)]
    np.testing.assert_array_equal(*values)


def test_unknown_covariance_is_an_unknown_deviation():
    value, variance = angular_momenta(motion_of(MODEL, swinging(MODEL, np.arange(5) / 50), covariance=np.eye(6)), MODEL)
    assert np.isfinite(value).all()
    assert np.isnan(variance).all()
