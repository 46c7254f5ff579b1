"""Landmarks give the pose back, within the joints' limits, and what they leave open stays near neutral."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Ellipsoid, Landmark, Part, Pose, Segment, human18, with_segment_lengths
from airborne.body.inverse_kinematics import CORE, fit_lengths, fit_pose
from airborne.errors import BodyError
from airborne.geometry.rotations import angles_from_matrix, geodesic
from tests.support.bodies import is_within_limits

MODEL = human18(1.75, 70.0)
NAMES = [landmark.name for landmark in MODEL.landmarks]
LIMBS = [name for name in NAMES if name not in ("neck", "torso", "pelvis")]
UPRIGHT = np.eye(3)
INVERTED = Rotation.from_euler("x", 180, degrees=True).as_matrix()
PRONE = Rotation.from_euler("x", 90, degrees=True).as_matrix()


def pose_within_limits(rng, share, R=None):
    """Joint angles anywhere up to a share of the way from straight to each limit."""
    limits = MODEL.limits
    straight = limits.nearest(limits.coordinates(np.eye(3)))
    far = np.where(rng.random(straight.shape) < 0.5, -1, 1) * limits.half_rad
    turned = limits.rotation(limits.nearest(straight + share * rng.random(straight.shape) * (far - straight)))
    rotation = Rotation.random(rng=rng) if R is None else Rotation.from_matrix(R)
    return Pose(
        world_from_root=RigidTransform.from_components(rng.normal(size=3), rotation),
        joint_angles=angles_from_matrix(turned),
    )


def landmarks(pose, names=NAMES, model=MODEL):
    return (
        dict(zip(NAMES, model.with_pose(pose).landmarks, strict=True))
        if names is NAMES
        else {name: place for name, place in landmarks(pose, model=model).items() if name in names}
    )


@pytest.mark.parametrize("seed", range(4))
def test_landmarks_of_any_pose_within_the_limits_are_met_to_a_millimetre(seed):
    pose = pose_within_limits(np.random.default_rng(seed), 0.5)
    fit = fit_pose(MODEL, landmarks(pose))
    assert max(fit.residual_m.values()) < 1e-3
    assert is_within_limits(MODEL, fit.pose)


@pytest.mark.parametrize("R", [UPRIGHT, PRONE, INVERTED], ids=["upright", "prone", "inverted"])
def test_orientation_of_the_pelvis_is_found_whichever_way_up(R):
    pose = pose_within_limits(np.random.default_rng(7), 0.4, R)
    fit = fit_pose(MODEL, landmarks(pose))
    assert geodesic(fit.pose.world_from_root.rotation.as_matrix(), R) < np.radians(3)


def test_residual_is_the_distance_of_the_posed_landmarks_from_the_targets():
    rng = np.random.default_rng(3)
    targets = {name: place + rng.normal(0, 0.02, 3) for name, place in landmarks(pose_within_limits(rng, 0.3)).items()}
    fit = fit_pose(MODEL, targets)
    posed = landmarks(fit.pose)
    for name, place in targets.items():
        assert fit.residual_m[name] == pytest.approx(np.linalg.norm(posed[name] - place), abs=1e-9)
    assert fit.rms_m == pytest.approx(np.sqrt(np.mean(np.square(list(fit.residual_m.values())))), abs=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_landmarks_wrong_by_20_mm_give_a_pose_within_limits_that_is_little_worse(seed):
    rng = np.random.default_rng(seed)
    pose = pose_within_limits(rng, 0.3)
    targets = {name: place + rng.normal(0, 0.02, 3) for name, place in landmarks(pose, LIMBS).items()}
    fit = fit_pose(MODEL, targets)
    assert is_within_limits(MODEL, fit.pose)
    assert fit.rms_m < 0.02 * np.sqrt(3), "no further off than the truth is"
    true, found = landmarks(pose), landmarks(fit.pose)
    assert np.sqrt(np.mean([np.sum((found[name] - true[name]) ** 2) for name in LIMBS])) < 0.035
    turns = [
        np.abs(fit.pose.joint_angles[MODEL.index_of(f"thigh_{side}") - 1] - angles).max()
        for side in ("left", "right")
        for angles in [pose.joint_angles[MODEL.index_of(f"thigh_{side}") - 1]]
    ]
    assert max(turns) < np.radians(25)


def test_limits_hold_however_far_the_targets_lie_beyond_them():
    straight = Pose(world_from_root=RigidTransform.identity(), joint_angles=np.zeros((17, 3)))
    targets = landmarks(straight)
    knee, ankle = targets["knee_left"], targets["ankle_left"]
    targets["ankle_left"] = knee + Rotation.from_euler("x", -60, degrees=True).apply(ankle - knee)  # bent forward
    fit = fit_pose(MODEL, targets)
    assert is_within_limits(MODEL, fit.pose)
    assert fit.residual_m["ankle_left"] > 0.05


def test_limb_without_landmarks_stays_straight():
    pose = pose_within_limits(np.random.default_rng(1), 0.5)
    unseen = ("elbow_left", "wrist_left", "hand_left")
    fit = fit_pose(MODEL, {name: place for name, place in landmarks(pose).items() if name not in unseen})
    for segment in ("upper_arm_left", "forearm_left", "hand_left"):
        np.testing.assert_allclose(fit.pose.joint_angles[MODEL.index_of(segment) - 1], 0, atol=1e-3)
    assert all(np.isnan(fit.residual_m[name]) for name in unseen)
    assert max(fit.residual_m[name] for name in NAMES if name not in unseen) < 1e-3


def test_unknown_place_is_the_same_as_none():
    targets = landmarks(pose_within_limits(np.random.default_rng(2), 0.3))
    without = fit_pose(MODEL, {name: place for name, place in targets.items() if name != "wrist_right"})
    unknown = fit_pose(MODEL, {**targets, "wrist_right": np.full(3, np.nan)})
    np.testing.assert_array_equal(unknown.pose.joint_angles, without.pose.joint_angles)


def test_spin_of_a_straight_arm_stays_small():
    pose = Pose(world_from_root=RigidTransform.identity(), joint_angles=np.zeros((17, 3)))
    pose.joint_angles[MODEL.index_of("upper_arm_left") - 1] = np.radians([-90.0, 0.0, 50.0])
    found = fit_pose(MODEL, landmarks(pose)).pose.joint_angles
    assert np.abs(found[MODEL.index_of("upper_arm_left") - 1, 2]) < np.radians(5)


def test_a_weight_draws_a_landmark_nearer():
    targets = landmarks(Pose(world_from_root=RigidTransform.identity(), joint_angles=np.zeros((17, 3))))
    targets["knee_left"] = targets["knee_left"] + [0.06, 0.0, -0.06]
    off = [fit_pose(MODEL, targets, weights={"knee_left": weight}).residual_m["knee_left"] for weight in (0.1, 30)]
    assert off[0] > 2 * off[1]


def test_search_from_a_start_stays_with_it():
    rng = np.random.default_rng(5)
    pose = pose_within_limits(rng, 0.4)
    nearby = Pose(
        world_from_root=pose.move(rng.normal(0, 0.02, 3), rng.normal(0, 0.05, 3)).world_from_root,
        joint_angles=pose.joint_angles + 0.05,
    )
    fit = fit_pose(MODEL, landmarks(pose), start=nearby)
    assert fit.rms_m < 1e-3
    few = fit_pose(MODEL, landmarks(pose, ("ankle_left", "ankle_right")), start=pose)
    np.testing.assert_allclose(few.pose.joint_angles, pose.joint_angles, atol=1e-3)


@pytest.mark.parametrize("missing", CORE)
def test_hips_and_shoulders_are_needed(missing):
    targets = landmarks(pose_within_limits(np.random.default_rng(0), 0.3))
    targets[missing] = np.full(3, np.nan)
    with pytest.raises(BodyError, match=f"needs both hips and both shoulders; not given: {missing}"):
        fit_pose(MODEL, targets)


def test_landmark_that_the_body_does_not_have_is_refused():
    with pytest.raises(BodyError, match="body 'human18' has no landmark hip_middle; it has: hip_left"):
        fit_pose(MODEL, {"hip_middle": np.zeros(3)})


def stick():
    part = Part("part", Ellipsoid(np.array([0.1, 0.1, 0.1])), RigidTransform.identity(), np.zeros(3))
    marks = [
        Landmark(name, "stick", np.array(place))
        for name, place in {"a": [0, 0, 0.5], "b": [0, 0, -0.5], "c": [0.3, 0, 0], "d": [0, 0, 0.0]}.items()
    ]
    return BodyModel("stick", (Segment("stick", None, np.zeros(3), (part,)),), tuple(marks))


def test_rigid_body_needs_three_landmarks_off_a_line():
    body = stick()
    root = RigidTransform.from_components([1.0, 2.0, 3.0], Rotation.from_rotvec([0.3, -2.0, 1.0]))
    places = dict(zip("abcd", body.with_pose(Pose(world_from_root=root)).landmarks, strict=True))
    fit = fit_pose(body, {name: places[name] for name in "abc"})
    np.testing.assert_allclose(fit.pose.world_from_root.as_matrix(), root.as_matrix(), atol=1e-6)
    for given in ("abd", "ac", ""):
        with pytest.raises(BodyError, match="needs three landmarks off a line; given: " + (", ".join(given) or "none")):
            fit_pose(body, {name: places[name] for name in given})


def test_lengths_of_a_person_are_found_from_poses():
    scales = {"thigh_left": 0.9, "thigh_right": 0.9, "shank_left": 1.1, "shank_right": 1.1}
    scales |= {"upper_arm_left": 0.95, "upper_arm_right": 0.95, "forearm_left": 1.2, "forearm_right": 1.2}
    person = with_segment_lengths(MODEL, scales)
    rng = np.random.default_rng(0)
    joints = np.stack([person.with_pose(pose_within_limits(rng, 0.4)).landmarks for _ in range(20)])
    found = fit_lengths(MODEL, joints)
    for name, scale in scales.items():
        assert found[name] == pytest.approx(scale, abs=1e-9)
    joints[:10, NAMES.index("knee_left")] = np.nan
    assert fit_lengths(MODEL, joints)["thigh_left"] == pytest.approx(0.9, abs=1e-9)


def test_trunk_and_shoulders_of_a_person_standing_straight_are_found():
    scales = {"pelvis": 1.1, "torso": 1.1, "chest": 1.1}
    person = with_segment_lengths(MODEL, scales)
    standing = person.with_pose(Pose(world_from_root=RigidTransform.identity())).landmarks[None]
    found = fit_lengths(MODEL, standing)
    for name, scale in scales.items():
        assert found[name] == pytest.approx(scale, abs=0.02), "the shoulders' own height does not grow with the trunk"
    wide = with_segment_lengths(MODEL, {"shoulder": 1.2}).with_pose(Pose(world_from_root=RigidTransform.identity()))
    assert fit_lengths(MODEL, wide.landmarks[None])["shoulder_left"] == pytest.approx(1.2, abs=1e-9)


def test_length_of_what_is_never_seen_is_left_out():
    joints = MODEL.with_pose(Pose(world_from_root=RigidTransform.identity())).landmarks[None].repeat(3, axis=0)
    joints[:, [NAMES.index("wrist_left"), NAMES.index("wrist_right")]] = np.nan
    found = fit_lengths(MODEL, joints)
    assert {"forearm_left", "forearm_right", "hand_left"}.isdisjoint(found)
    assert found["upper_arm_left"] == pytest.approx(1, abs=1e-9)
