"""The laws of flight with moving joints."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Inertia, Part, Segment, human18
from airborne.constants import FREE_FALL_M_S2
from airborne.errors import BodyError
from airborne.geometry.rotations import geodesic
from airborne.synthetic.flight.articulated import (
    Takeoff,
    fly_articulated,
    joint_motion,
    mass_at_angles,
    scale_time,
    sum_motions,
    with_fixed_joints,
)
from airborne.synthetic.flight.rigid import Launch, MassProperties, fly
from tests.support.synthetic import constant_joints
from tests.support.tolerances import EXACT, ROUNDTRIP

TIMES = np.arange(0, 0.61, 0.05)
STRAIGHT = np.zeros((4, 3))
BENT = np.array([[0.4, -1.1, 0.3], [0.2, 0.0, 0.9], [-0.8, 1.3, 0.2], [-1.0, 0.1, 0.2]])
NODES = np.cos(np.pi * (np.arange(13) + 0.5) / 13)  # Chebyshev's, in (-1, 1)


def segment(rng, name, parent, joint_m):
    """A segment with its centre of mass off its axis, and a tensor that a solid could have."""
    axes = Rotation.random(rng=rng).as_matrix()
    a, b = rng.uniform(0.02, 0.05, 2)
    tensor = axes @ np.diag([a, b, rng.uniform(0.7, 0.95) * (a + b)]) @ axes.T
    centre = np.array([0.02, -0.03, -0.15]) + rng.normal(0, 0.02, 3)
    box = Part(f"{name}_box", Box(np.array([0.1, 0.1, 0.3])), RigidTransform.from_translation(centre), None)
    return Segment(name, parent, np.array(joint_m), (box,), inertia=Inertia(float(rng.uniform(2, 6)), centre, tensor))


def body():
    """A trunk with a left arm of two segments, a right arm of one, and a leg."""
    rng = np.random.default_rng(11)
    trunk = segment(rng, "trunk", None, (0.0, 0.0, 0.0))
    heavy = Inertia(30.0, np.array([0.0, 0.01, 0.2]), np.diag([1.2, 1.0, 0.4]))
    return BodyModel(
        "body",
        (
            replace(trunk, inertia=heavy),
            segment(rng, "arm_left", "trunk", (0.2, 0.0, 0.45)),
            segment(rng, "hand_left", "arm_left", (0.0, 0.0, -0.3)),
            segment(rng, "arm_right", "trunk", (-0.2, 0.0, 0.45)),
            segment(rng, "leg", "trunk", (0.0, 0.0, -0.1)),
        ),
    )


BODY = body()


def takeoff(**changes):
    given = {
        "centre": np.array([0.1, -0.2, 1.3]),
        "velocity": np.array([0.3, -1.2, 3.2]),
        "R": Rotation.from_rotvec([0.4, 1.1, -0.7]).as_matrix(),
        "angular_momentum": np.array([14.0, 2.0, -3.0]),
    }
    return Takeoff(**{**given, **changes})


def bending():
    """Three moves, one after another and one across them; breaks at 0.05, 0.11, 0.2, 0.33 and 0.47 s."""
    first = joint_motion(np.array([0.05, 0.2, 0.33]), np.array([STRAIGHT, BENT, 0.3 * BENT]))
    across = joint_motion(np.array([0.11, 0.47]), np.array([STRAIGHT, np.tile([-0.7, 0.2, 0.5], (4, 1))]))
    return sum_motions([first, across])


def momenta(model, flight, half_s):
    """Linear and angular momentum at the middle of a flight sampled at `NODES` times half_s, from its poses alone."""
    posed = [model.with_pose(flight.pose(i)) for i in range(len(flight.time_s))]
    mass = np.array([s.inertia.mass_kg for s in model.segments])
    R = np.array([p.R for p in posed])
    local = np.array([s.inertia.centre_m for s in model.segments])
    centre = np.einsum("nsij,sj->nsi", R, local) + np.array([p.t for p in posed])
    (R, R_rate), (centre, speed) = (at_middle(values, half_s) for values in (R, centre))
    w = (R_rate @ np.swapaxes(R, -1, -2))[:, (2, 0, 1), (1, 2, 0)]
    own = R @ np.array([s.inertia.tensor_kg_m2 for s in model.segments]) @ np.swapaxes(R, -1, -2)
    about = centre - mass @ centre / mass.sum()
    return mass @ speed, np.einsum("sij,sj->i", own, w) + mass @ np.cross(about, speed)


def at_middle(values, half_s):
    """Values and their rate in the middle of the nodes, by the polynomial through all of them."""
    series = np.polynomial.chebyshev.chebfit(NODES, values.reshape(len(NODES), -1), len(NODES) - 1)
    rate = np.polynomial.chebyshev.chebder(series)
    return [
        np.polynomial.chebyshev.chebval(0.0, c).reshape(values.shape[1:]) * scale
        for c, scale in ((series, 1), (rate, 1 / half_s))
    ]


@pytest.mark.parametrize("middle", [0.02, 0.155, 0.265, 0.4, 0.55])
def test_momentum_recomputed_from_the_poses_stays_the_same(middle):
    half = 0.03
    flight = fly_articulated(BODY, takeoff(), bending(), middle + half * NODES)
    linear, angular = momenta(BODY, flight, half)
    given = takeoff()
    np.testing.assert_allclose(angular, given.angular_momentum, atol=1e-9 * np.linalg.norm(given.angular_momentum))
    mass = sum(s.inertia.mass_kg for s in BODY.segments)
    np.testing.assert_allclose(linear, mass * (given.velocity + FREE_FALL_M_S2 * middle), rtol=ROUNDTRIP)


def test_momentum_of_a_gymnast_stays_the_same_too():
    model, half = human18(1.66, 58.0), 0.02
    rng = np.random.default_rng(5)
    lowest, highest = np.clip(np.moveaxis(model.limits.angle_ranges_rad, -1, 0), -1, 1)
    joints = joint_motion(np.array([0.0, 0.3]), rng.uniform(lowest, highest, (2, 17, 3)))
    given = takeoff(angular_momentum=np.array([70.0, 5.0, -3.0]))
    flight = fly_articulated(model, given, joints, 0.15 + half * NODES)
    np.testing.assert_allclose(momenta(model, flight, half)[1], given.angular_momentum, atol=70e-9)


def test_flight_says_the_momentum_that_it_was_given():
    flight = fly_articulated(BODY, takeoff(), bending(), TIMES)
    np.testing.assert_allclose(flight.angular_momentum - takeoff().angular_momentum, 0, atol=EXACT * 100)


def test_second_difference_of_the_centre_of_mass_of_the_segments_is_gravity():
    flight = fly_articulated(BODY, takeoff(), bending(), TIMES)
    mass = np.array([s.inertia.mass_kg for s in BODY.segments])
    local = np.array([s.inertia.centre_m for s in BODY.segments])
    result = []
    for i in range(len(TIMES)):
        posed = BODY.with_pose(flight.pose(i))
        result.append(mass @ (np.einsum("sij,sj->si", posed.R, local) + posed.t) / mass.sum())
    np.testing.assert_allclose(result, flight.centre, atol=EXACT)
    acceleration = np.diff(result, 2, axis=0) / 0.05**2
    np.testing.assert_allclose(acceleration, np.broadcast_to(FREE_FALL_M_S2, acceleration.shape), atol=ROUNDTRIP)


def test_body_with_fixed_joints_flies_as_the_rigid_body_of_that_shape():
    flight = fly_articulated(BODY, takeoff(), constant_joints(BENT), np.array([0.3, -0.2, 0.0, 0.5, 0.3]))
    mass = mass_at_angles(BODY, BENT)
    w = np.linalg.solve(mass.inertia, takeoff().R.T @ takeoff().angular_momentum)
    launch = Launch(centre=takeoff().centre, velocity=takeoff().velocity, R=takeoff().R, angular_velocity=w)
    rigid = fly(mass, launch, flight.time_s)
    for name in ("R", "position", "centre", "angular_velocity", "angular_momentum"):
        np.testing.assert_allclose(getattr(flight, name), getattr(rigid, name), atol=ROUNDTRIP, err_msg=name)
    energy = np.einsum("ni,ij,nj->n", flight.angular_velocity, mass.inertia, flight.angular_velocity) / 2
    np.testing.assert_allclose(energy, energy[0], rtol=ROUNDTRIP)
    assert geodesic(flight.R[0], flight.R[2]) > 0.5


def test_top_nods_at_the_rate_of_its_angular_momentum_over_its_transverse_inertia():
    A, C = 0.3, 0.1
    ball = BODY.segments[0].parts
    top = BodyModel(
        "top",
        (Segment("top", None, np.zeros(3), ball, inertia=Inertia(2.0, np.array([0, 0, 0.4]), np.diag([A, A, C]))),),
    )
    R, w = takeoff().R, np.array([1.5, 0.0, 12.0])
    L = R @ np.diag([A, A, C]) @ w
    flight = fly_articulated(top, takeoff(angular_momentum=L), constant_joints(np.zeros((0, 3))), TIMES)
    precession = Rotation.from_rotvec(TIMES[:, None] * L / A).as_matrix()
    np.testing.assert_allclose(flight.R[:, :, 2], precession @ R[:, 2], atol=ROUNDTRIP)
    spin = (1 - C / A) * 12.0
    np.testing.assert_allclose(flight.angular_velocity[:, 0], 1.5 * np.cos(spin * TIMES), atol=ROUNDTRIP)


def test_body_without_momentum_turns_against_its_arms_and_comes_back_with_them():
    joint = np.zeros((4, 3))
    joint[[0, 2], 1] = -1.2  # both arms turn backward about y
    joints = joint_motion(np.array([0.1, 0.3, 0.5]), np.array([STRAIGHT, joint, STRAIGHT]))
    start = takeoff(angular_momentum=np.zeros(3), R=np.eye(3))
    flight = fly_articulated(BODY, start, joints, np.array([0.05, 0.2, 0.3, 0.6]))
    turned = Rotation.from_matrix(flight.R).as_rotvec()
    np.testing.assert_allclose(flight.R[[0, 3]], np.broadcast_to(np.eye(3), (2, 3, 3)), atol=ROUNDTRIP)
    assert turned[2, 1] > turned[1, 1] > 0.01  # the trunk turns forward
    flight = fly_articulated(BODY, start, scale_time(joints, 7.0), np.array([2.1]))
    np.testing.assert_allclose(Rotation.from_matrix(flight.R).as_rotvec(), turned[[2]], atol=ROUNDTRIP)


def test_rotations_follow_the_angular_velocity_whatever_the_order_of_the_times():
    step = 1e-5
    flight = fly_articulated(BODY, takeoff(), bending(), np.array([0.25 + step, 0.25, -0.1, 0.25 - step, 0.25]))
    turned = Rotation.from_matrix(flight.R[3].T @ flight.R[0]).as_rotvec() / (2 * step)
    np.testing.assert_allclose(turned, flight.angular_velocity[1], rtol=1e-6)
    np.testing.assert_array_equal(flight.R[1], flight.R[4])
    alone = fly_articulated(BODY, takeoff(), bending(), np.array([-0.1]))
    np.testing.assert_allclose(flight.R[2], alone.R[0], atol=ROUNDTRIP)


def test_short_joint_motion_late_in_a_flight_without_rotation_is_not_missed():
    joints = joint_motion(np.array([5.0, 5.02]), np.array([STRAIGHT, BENT]))
    start = takeoff(angular_momentum=np.zeros(3))
    flight = fly_articulated(BODY, start, joints, np.array([4.9, 6.0]))
    early = fly_articulated(
        BODY, start, joint_motion(np.array([0.0, 0.02]), np.array([STRAIGHT, BENT])), np.array([1.0])
    )
    np.testing.assert_allclose(flight.R[1], early.R[0], atol=ROUNDTRIP)
    assert geodesic(flight.R[1], flight.R[0]) > 0.05


def test_joint_motions_rest_at_their_ends_with_a_continuous_acceleration():
    joints = joint_motion(np.array([0.1, 0.3, 0.6]), np.array([STRAIGHT, BENT, -BENT]))
    np.testing.assert_allclose(joints([0.1, 0.3, 0.6]), [STRAIGHT, BENT, -BENT], atol=EXACT)
    for order in (1, 2):
        np.testing.assert_allclose(joints([0.1, 0.3, 0.6], order), 0, atol=1e-9)
        np.testing.assert_allclose(joints([0.3 - 1e-12], order), 0, atol=1e-7)
    assert np.all(np.diff(joints(np.linspace(0.1, 0.3, 30))[:, 0, 0]) >= 0)


def test_sum_of_motions_is_their_sum_at_every_time_of_either():
    a = joint_motion(np.array([0.0, 0.4]), np.array([STRAIGHT, BENT]))
    b = joint_motion(np.array([0.3, 0.5, 0.9]), np.array([STRAIGHT, -BENT, BENT]))
    t = np.linspace(0, 0.9, 50)
    expected = a(np.minimum(t, 0.4)) + b(np.maximum(t, 0.3))
    np.testing.assert_allclose(sum_motions([a, b])(t), expected, atol=EXACT)
    np.testing.assert_allclose(
        sum_motions([a, b])(t, 1), a(np.minimum(t, 0.4), 1) + b(np.maximum(t, 0.3), 1), atol=1e-11
    )


def test_flight_scaled_in_time_with_less_momentum_passes_the_same_orientations():
    quick = fly_articulated(BODY, takeoff(), bending(), TIMES)
    weak = takeoff(angular_momentum=takeoff().angular_momentum / 3)
    slow = fly_articulated(BODY, weak, scale_time(bending(), 3.0), 3 * TIMES)
    np.testing.assert_allclose(slow.R, quick.R, atol=ROUNDTRIP)
    np.testing.assert_allclose(slow.joint_angles, quick.joint_angles, atol=EXACT)


def test_fixed_joints_keep_the_root_and_the_given_angles():
    flight = fly_articulated(BODY, takeoff(), bending(), TIMES)
    held = with_fixed_joints(BODY, flight, BENT)
    np.testing.assert_array_equal(held.R, flight.R)
    np.testing.assert_array_equal(held.position, flight.position)
    np.testing.assert_array_equal(held.pose(7).joint_angles, BENT)
    np.testing.assert_allclose(held.centre, flight.position + flight.R @ mass_at_angles(BODY, BENT).centre, atol=EXACT)
    assert np.isnan(held.angular_momentum).all()


def test_mass_of_a_straight_body_is_the_sum_of_its_segments():
    result = mass_at_angles(BODY, STRAIGHT)
    origins = {None: np.zeros(3)}
    positions, tensors, masses = [], [], []
    for s in BODY.segments:
        origins[s.name] = origins[s.parent] + s.joint_m
        positions.append(origins[s.name] + s.inertia.centre_m)
        tensors.append(s.inertia.tensor_kg_m2)
        masses.append(s.inertia.mass_kg)
    centre = np.average(positions, axis=0, weights=masses)
    arms = np.array(positions) - centre
    inertia = sum(J + m * (d @ d * np.eye(3) - np.outer(d, d)) for J, m, d in zip(tensors, masses, arms, strict=True))
    assert isinstance(result, MassProperties)
    assert result.mass_kg == pytest.approx(sum(masses), rel=EXACT)
    np.testing.assert_allclose(result.centre, centre, atol=EXACT)
    np.testing.assert_allclose(result.inertia, inertia, atol=EXACT)


def test_body_with_a_segment_without_inertia_is_refused_by_name():
    weightless = replace(BODY, segments=(*BODY.segments[:-1], replace(BODY.segments[-1], inertia=None)))
    with pytest.raises(BodyError, match="segment 'leg' has no inertia"):
        fly_articulated(weightless, takeoff(), constant_joints(STRAIGHT), TIMES)


def test_mujoco_flies_a_somersault_to_the_same_landing():
    mujoco = pytest.importorskip("mujoco")
    from airborne.synthetic.flight.skill import half_twist

    skill = half_twist(human18(1.66, 58.0), has_pike=True)
    flight = skill(np.array([0.0, skill.duration_s]))
    R, position = fly_in_mujoco(mujoco, skill, flight, step_s=skill.duration_s / 400)
    assert geodesic(R, flight.R[1]) < np.radians(0.001)
    assert np.linalg.norm(position - flight.position[1]) < 1e-5


def fly_in_mujoco(mujoco, skill, flight, step_s):
    """Drive MuJoCo's joints along the skill's angles by inverse dynamics; return the root's landing R and place."""
    model = mujoco.MjModel.from_xml_string(mjcf(skill.model, step_s))
    data = mujoco.MjData(model)
    n_joints, w = len(skill.model.segments) - 1, flight.angular_velocity[0]
    data.qpos[:3], data.qpos[3:7] = flight.position[0], scalar_first(Rotation.from_matrix(flight.R[0]))
    data.qpos[7:] = scalar_first(wanted_turns(skill, 0.0)).ravel()
    arm = flight.position[0] - flight.centre[0]
    data.qvel[:3], data.qvel[3:6] = skill.takeoff.velocity + np.cross(flight.R[0] @ w, arm), w
    inertia = np.zeros((model.nv, model.nv))

    def drive(model, data):
        """Set the joint torques that give the wanted joint accelerations, the root being free."""
        error = Rotation.from_quat(data.qpos[7:].reshape(n_joints, 4)[:, [1, 2, 3, 0]]).inv()
        error = (error * wanted_turns(skill, data.time)).as_rotvec().ravel()
        rate, acceleration = wanted_rates(skill, data.time)
        a = acceleration + 40 * (rate - data.qvel[6:]) + 400 * error
        mujoco.mj_fullM(model, data, inertia)
        root = np.linalg.solve(inertia[:6, :6], -data.qfrc_bias[:6] - inertia[:6, 6:] @ a)
        data.qfrc_applied[6:] = inertia[6:, :6] @ root + inertia[6:, 6:] @ a + data.qfrc_bias[6:]

    mujoco.set_mjcb_control(drive)
    try:
        for _ in range(round(skill.duration_s / step_s)):
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_control(None)
    return Rotation.from_quat(data.qpos[[4, 5, 6, 3]]).as_matrix(), data.qpos[:3].copy()


def scalar_first(rotation):
    return rotation.as_quat()[..., [3, 0, 1, 2]]


def wanted_turns(skill, time):
    at = np.clip(time, skill.joints.x[0], skill.joints.x[-1])
    return Rotation.from_euler("XYZ", skill.joints(at))


def wanted_rates(skill, time, h=1e-4):
    """Angular velocity and acceleration of every joint in its segment's axes, by differences of the turns."""
    before, now, after = (wanted_turns(skill, time + k * h) for k in (-1, 0, 1))
    ahead, behind = (now.inv() * after).as_rotvec(), (before.inv() * now).as_rotvec()
    return ((ahead + behind) / (2 * h)).ravel(), ((ahead - behind) / h**2).ravel()


def mjcf(model, step_s):
    """Write a body for MuJoCo: a free root, balls for joints, masses without shapes."""
    children = {s.name: [c for c in model.segments if c.parent == s.name] for s in model.segments}

    def numbers(values):
        return " ".join(repr(float(v)) for v in np.ravel(values))

    def write_segment(segment):
        J, tensor = segment.inertia, segment.inertia.tensor_kg_m2
        joint = "<freejoint/>" if segment.parent is None else '<joint type="ball"/>'
        inside = "".join(write_segment(child) for child in children[segment.name])
        return (
            f'<body name="{segment.name}" pos="{numbers(segment.joint_m)}">{joint}'
            f'<inertial pos="{numbers(J.centre_m)}" mass="{J.mass_kg!r}" '
            f'fullinertia="{numbers(tensor[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)])}"/>{inside}</body>'
        )

    return (
        f'<mujoco><compiler angle="radian" balanceinertia="false"/>'
        f'<option timestep="{step_s}" integrator="RK4" gravity="0 0 -9.81"/>'
        f"<worldbody>{write_segment(model.segments[0])}</worldbody></mujoco>"
    )
