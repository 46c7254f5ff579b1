"""Joint angles in ISB's sequences: postures have the angles that Wu et al. (2002, 2005) give them, on both sides."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.motion.isb import isb_angles
from tests.support.motions import motion_of, shaken
from tests.support.people import HUMAN
from tests.support.tolerances import ROUNDTRIP, sampled

NAMES = [segment.name for segment in HUMAN.segments[1:]]
LEFT, FORWARD, UP = np.array([1.0, 0, 0]), np.array([0.0, -1, 0]), np.array([0.0, 0, 1])  # of the body


def posed(**turns):
    """Pose the person: by segment, rotations (axis, degrees) one after the other in the parent's axes."""
    angles = np.zeros((len(NAMES), 3))
    for name, steps in turns.items():
        R = Rotation.identity()
        for axis, degrees in steps:
            R = Rotation.from_rotvec(np.radians(degrees) * axis) * R
        angles[NAMES.index(name)] = R.as_euler("XYZ")
    return Pose(world_from_root=RigidTransform.identity(), joint_angles=angles)


def found(name, pose):
    table = isb_angles(motion_of(HUMAN, [pose], covariance=np.eye(HUMAN.n_dofs) * 1e-4), HUMAN)
    return table.sel(joint=name).isel(time=0)


# the right side's posture: rotations of the segment, right-handed, in the body's axes; its three angles
POSTURES = {
    "hip flexed": ("thigh", [(-LEFT, 60)], [60, 0, 0]),
    "hip adducted": ("thigh", [(FORWARD, 20)], [0, 20, 0]),
    "hip turned in": ("thigh", [(UP, 25)], [0, 0, 25]),
    "knee flexed": ("shank", [(LEFT, 70)], [-70, 0, 0]),
    "ankle dorsiflexed": ("foot", [(-LEFT, 15)], [15, 0, 0]),
    "foot inverted": ("foot", [(FORWARD, 10)], [0, 10, 0]),
    "palm at the thigh": ("forearm", [], [0, 0, 90]),
    "elbow flexed, palm up": ("forearm", [(UP, -90), (-LEFT, 80)], [80, 0, 0]),
    "wrist flexed": ("hand", [(-FORWARD, -30)], [30, 0, 0]),
    "girdle protracted": ("shoulder", [(UP, 12)], [12, 0, 0]),
    "girdle elevated": ("shoulder", [(FORWARD, -9)], [0, -9, 0]),
    "arm abducted": ("upper_arm", [(FORWARD, -80)], [0, -80, 0]),
    "arm flexed": ("upper_arm", [(-LEFT, 80)], [90, -80, -90]),
    "arm abducted, turned out": ("upper_arm", [(UP, -40), (FORWARD, -80)], [0, -80, -40]),
}


@pytest.mark.parametrize(("segment", "steps", "expected"), POSTURES.values(), ids=POSTURES)
def test_postures_have_the_published_angles_on_both_sides(segment, steps, expected):
    right = found(f"{segment}_right", posed(**{f"{segment}_right": steps}))
    np.testing.assert_allclose(right["isb_angle"], expected, atol=1e3 * ROUNDTRIP)
    mirrored = [(axis * [1, -1, -1], degrees) for axis, degrees in steps]
    left = found(f"{segment}_left", posed(**{f"{segment}_left": mirrored}))
    np.testing.assert_allclose(left["isb_angle"], expected, atol=1e3 * ROUNDTRIP)


def test_trunk_bends_in_the_bodys_own_planes():
    for axis, expected in ((-LEFT, [10, 0, 0]), (FORWARD, [0, 10, 0]), (UP, [0, 0, 10])):
        np.testing.assert_allclose(
            found("chest", posed(chest=[(axis, 10)]))["isb_angle"], expected, atol=1e3 * ROUNDTRIP
        )


def test_sequences_are_those_recommended():
    table = isb_angles(motion_of(HUMAN, [posed()]), HUMAN)
    of = dict(zip(NAMES, table["isb_sequence"].to_numpy().tolist(), strict=True))
    assert {name for name in NAMES if of[name] == "YXY"} == {"upper_arm_left", "upper_arm_right"}
    assert {name for name in NAMES if of[name] == "YXZ"} == {"shoulder_left", "shoulder_right"}
    assert {of[name] for name in NAMES} == {"ZXY", "YXZ", "YXY"}


def test_arm_is_told_against_the_thorax_through_the_girdle():
    pose = posed(shoulder_right=[(FORWARD, -20)], upper_arm_right=[(FORWARD, -50)])
    np.testing.assert_allclose(found("upper_arm_right", pose)["isb_angle"], [0, -70, 0], atol=1e3 * ROUNDTRIP)


def test_arm_swings_through_the_singular_hang_without_a_jump_flagged_there():
    swing = np.linspace(-60, 60, 41)
    poses = [posed(upper_arm_right=[(-LEFT, angle), (FORWARD, -0.5)]) for angle in swing]
    table = isb_angles(motion_of(HUMAN, poses), HUMAN).sel(joint="upper_arm_right")
    np.testing.assert_array_equal(table["isb_is_singular"], np.abs(table["isb_angle"].sel(rotation=2)) < 5)
    steady = ~table["isb_is_singular"].to_numpy()
    assert 3 <= np.sum(~steady) <= 5
    assert np.abs(np.diff(table["isb_angle"].to_numpy()[steady][:18], axis=0)).max() < 4


def test_deviations_are_those_of_sampled_poses():
    rng, covariance, n = np.random.default_rng(6), np.diag(np.full(HUMAN.n_dofs, 1e-4)), 200
    pose = posed(shoulder_left=[(FORWARD, 10)], upper_arm_left=[(FORWARD, 70), (LEFT, -20)], shank_left=[(LEFT, 40)])
    table = isb_angles(motion_of(HUMAN, [pose], covariance=covariance), HUMAN)
    drawn = isb_angles(motion_of(HUMAN, [shaken(rng, pose, covariance) for _ in range(n)]), HUMAN)
    for name in ("upper_arm_left", "shank_left"):
        spread = drawn["isb_angle"].sel(joint=name).std("time")
        np.testing.assert_allclose(table["isb_angle_sd"].sel(joint=name)[0], spread, rtol=sampled(n))
