"""The preset human18: its tree, its proportions, and which way its joints turn."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import SAMPLED, Ellipsoid, Pose, human18, human18_from_measurements
from airborne.body.anthropometry import measurements_of, segment_properties
from airborne.body.human import PARENTS
from airborne.errors import BodyError
from airborne.geometry.rotations import matrix_from_angles
from tests.support.bodies import total_inertia
from tests.support.tolerances import EXACT, ROUNDTRIP
from tests.support.yeadon_oracle import ANGLES, SEGMENTS, random_configuration, same_pose, yeadon_person

PEOPLE = [(1.80, 75.0), (1.55, 44.0), (2.05, 102.0)]
LIMB = ["hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist", "hand"]


def posed(model=None, root=None, **degrees):
    model = model or human18()
    angles = np.zeros((17, 3))
    for segment, xyz in degrees.items():
        angles[model.index_of(segment) - 1] = np.radians(xyz)
    return model.with_pose(Pose(world_from_root=root or RigidTransform.identity(), joint_angles=angles))


def positions(body):
    return dict(zip([mark.name for mark in body.model.landmarks], body.landmarks, strict=True))


def mirrored(name):
    return name.replace("_left", "_?").replace("_right", "_left").replace("_?", "_right")


def test_it_is_the_papers_tree_of_18_segments_with_57_degrees_of_freedom():
    model = human18()
    assert {segment.name: segment.parent for segment in model.segments} == PARENTS
    assert [segment.name for segment in model.segments] == list(PARENTS)
    assert 6 + 3 * (len(model.segments) - 1) == 57
    assert model.limits.half_rad.shape == (17, 3)


def test_landmarks_are_joint_centres_balls_of_the_feet_hands_and_head():
    expected = [f"{name}_{side}" for side in ("left", "right") for name in LIMB] + ["pelvis", "torso", "neck", "head"]
    at = positions(posed())
    assert list(at) == expected
    joints = dict(zip(PARENTS, posed().t, strict=True))
    for landmark, segment in {"knee_left": "shank_left", "wrist_right": "hand_right", "neck": "head"}.items():
        np.testing.assert_allclose(at[landmark], joints[segment], atol=EXACT)
    np.testing.assert_allclose(at["pelvis"], (at["hip_left"] + at["hip_right"]) / 2, atol=EXACT)
    crown_m = measurements_of(1.80, 75.0).values_m["Ls8L"]
    assert crown_m - (at["head"] - at["neck"])[2] == pytest.approx(0.13, abs=0.005)  # the ears' depth below the crown


def test_zero_pose_stands_upright_with_hanging_arms_level_feet_and_toes_forward():
    at = positions(posed())
    for side, sign in (("left", 1), ("right", -1)):
        ball, ankle = at[f"foot_{side}"], at[f"ankle_{side}"]
        assert ball[1] < ankle[1] - 0.1
        assert np.allclose(ball[0], ankle[0])
        heights = [at[f"{name}_{side}"][2] for name in ("hip", "knee", "ankle", "foot")]
        assert heights == sorted(heights, reverse=True)
        arm = np.array([at[f"{name}_{side}"] for name in ("shoulder", "elbow", "wrist", "hand")])
        np.testing.assert_allclose(arm[:, :2], np.tile(arm[0, :2], (4, 1)), atol=EXACT)
        assert np.all(np.diff(arm[:, 2]) < 0)
        assert sign * arm[0, 0] > 0
    assert at["head"][2] > at["neck"][2] > at["torso"][2] > at["pelvis"][2]


@pytest.mark.parametrize(("stature", "mass"), PEOPLE)
def test_from_sole_to_crown_it_measures_its_stature(stature, mass):
    body = posed(human18(stature, mass))
    ends = [
        R @ part.segment_from_part.apply([0, 0, 0])
        + t
        + sign * np.sqrt(((R @ part.segment_from_part.rotation.as_matrix() * part.shape.semi_axes_m)[2] ** 2).sum())
        for segment, R, t in zip(body.model.segments, body.R, body.t, strict=True)
        for part in segment.parts
        for sign in (-1, 1)
    ]
    assert np.ptp([end[2] for end in ends]) == pytest.approx(stature, abs=ROUNDTRIP)


@pytest.mark.parametrize(("stature", "mass"), PEOPLE)
def test_it_weighs_its_mass_in_the_proportions_of_a_man(stature, mass):
    model = human18(stature, mass)
    kg = {segment.name: segment.inertia.mass_kg for segment in model.segments}
    assert sum(kg.values()) == pytest.approx(mass, rel=EXACT)
    trunk = sum(kg[name] for name in ("pelvis", "torso", "chest", "shoulder_left", "shoulder_right"))
    shares = {  # de Leva (1996), men
        "head": 0.0694,
        "upper_arm_left": 0.0271,
        "forearm_left": 0.0162,
        "thigh_left": 0.1416,
        "shank_left": 0.0433,
        "foot_left": 0.0137,
    }
    assert trunk / mass == pytest.approx(0.4346, rel=0.05)
    for name, share in shares.items():
        assert kg[name] / mass == pytest.approx(share, rel=0.15), name
    body = posed(model)
    sole = positions(body)["ankle_left"][2] - 0.039 * stature
    assert 0.54 < (total_inertia(body).centre_m[2] - sole) / stature < 0.575


@pytest.mark.parametrize(("stature", "mass"), PEOPLE)
def test_lengths_are_the_standard_shares_of_stature(stature, mass):
    at = positions(posed(human18(stature, mass)))
    shares = {  # Drillis and Contini
        ("hip_left", "knee_left"): 0.245,
        ("knee_right", "ankle_right"): 0.246,
        ("shoulder_left", "elbow_left"): 0.186,
        ("elbow_right", "wrist_right"): 0.146,
    }
    for (a, b), share in shares.items():
        assert np.linalg.norm(at[a] - at[b]) == pytest.approx(share * stature, rel=ROUNDTRIP)
    assert at["shoulder_left"][2] - at["hip_left"][2] == pytest.approx(0.288 * stature, rel=ROUNDTRIP)
    assert np.linalg.norm(at["hip_left"] - at["hip_right"]) == pytest.approx(0.10 * stature, rel=0.08)


def test_people_of_one_build_are_enlarged_copies():
    small, k = human18(1.5, 50.0), 1.2
    large = human18(1.5 * k, 50.0 * k**3)
    for a, b in zip(small.segments, large.segments, strict=True):
        np.testing.assert_allclose(b.joint_m, k * a.joint_m, atol=ROUNDTRIP)
        np.testing.assert_allclose(b.inertia.tensor_kg_m2, k**5 * a.inertia.tensor_kg_m2, rtol=1e-9, atol=ROUNDTRIP)
        for p, q in zip(a.parts, b.parts, strict=True):
            np.testing.assert_allclose(q.shape.semi_axes_m, k * p.shape.semi_axes_m, atol=ROUNDTRIP)


def test_a_heavier_person_of_one_stature_is_thicker_by_the_root_of_the_mass():
    thin, thick = human18(1.8, 60.0), human18(1.8, 90.0)
    for a, b in zip(thin.segments, thick.segments, strict=True):
        if a.name.startswith(("thigh", "torso", "forearm")):
            ratio = b.parts[0].shape.semi_axes_m[:2] / a.parts[0].shape.semi_axes_m[:2]
            np.testing.assert_allclose(ratio, np.sqrt(1.5), rtol=0.05)  # ends are rounder
            np.testing.assert_allclose(b.inertia.mass_kg / a.inertia.mass_kg, 1.5, rtol=ROUNDTRIP)


def test_right_is_left_in_a_mirror():
    model, flip = human18(), np.array([-1.0, 1, 1])
    for segment in model.segments:
        twin = model.segments[model.index_of(mirrored(segment.name))]
        np.testing.assert_allclose(twin.joint_m, flip * segment.joint_m, atol=EXACT)
        np.testing.assert_allclose(twin.inertia.centre_m, flip * segment.inertia.centre_m, atol=EXACT)
        tensor = segment.inertia.tensor_kg_m2 * np.outer(flip, flip)
        np.testing.assert_allclose(twin.inertia.tensor_kg_m2, tensor, atol=EXACT)
        np.testing.assert_array_equal(twin.limits.half_rad, segment.limits.half_rad)
        mirrored_centre = segment.limits.centre * np.outer(flip, flip)
        np.testing.assert_allclose(twin.limits.centre, mirrored_centre, atol=EXACT)
        for p, q in zip(segment.parts, twin.parts, strict=True):
            np.testing.assert_allclose(q.shape.semi_axes_m, p.shape.semi_axes_m, atol=EXACT)
            centre = flip * p.segment_from_part.translation
            np.testing.assert_allclose(q.segment_from_part.translation, centre, atol=EXACT)
            assert q.slab_m == p.slab_m


@pytest.mark.parametrize("name", ["pelvis", "torso", "chest", "head", "upper_arm_left", "forearm_right", "shank_left"])
def test_an_ellipsoid_holds_its_segments_volume_between_the_joints(name):
    person = measurements_of(1.80, 75.0)
    model, v = human18(outfit=SAMPLED), person.values_m
    segment = model.segments[model.index_of(name)]
    part = segment.parts[0]
    assert isinstance(part.shape, Ellipsoid)
    child = {"upper_arm_left": "forearm_left", "forearm_right": "hand_right", "shank_left": "foot_left"}
    chest = v["Ls4L"] - v["Ls3L"]
    end = {"pelvis": -v["Ls2L"], "torso": v["Ls3L"] - v["Ls2L"], "chest": chest, "head": v["Ls8L"]}
    far = end[name] if name in end else model.segments[model.index_of(child[name])].joint_m[2]
    edges = np.linspace(min(far, 0), max(far, 0), 20001)
    z = (edges[1:] + edges[:-1]) / 2 - part.segment_from_part.translation[2]
    a, b, c = part.shape.semi_axes_m
    volume = np.sum(np.pi * a * b * np.clip(1 - (z / c) ** 2, 0, None)) * np.diff(edges)[0]
    assert volume == pytest.approx(segment_properties(person)[name].volume_m3, rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_joint_centres_and_axes_are_where_yeadons_own_model_has_them(seed):
    person, configuration = measurements_of(1.75, 70.0), random_configuration(seed)
    human = yeadon_person(person, configuration)
    model = human18_from_measurements(person)
    body = model.with_pose(same_pose(person, configuration))
    turned = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    for theirs, ours in SEGMENTS.items():
        segment, index = getattr(human, theirs), model.index_of(ours)
        np.testing.assert_allclose(body.t[index], segment.pos.ravel(), atol=EXACT)
        R = body.R[index] @ turned if ours.startswith("forearm") else body.R[index]
        np.testing.assert_allclose(R, segment.rot_mat, atol=EXACT)
    at = positions(body)
    np.testing.assert_allclose(at["pelvis"], 0, atol=EXACT)
    for theirs, ours in {"A2": "wrist_left", "B2": "wrist_right", "J2": "ankle_left", "K2": "ankle_right"}.items():
        chain = getattr(human, theirs).solids[2]  # the hand, or the foot, begins there
        np.testing.assert_allclose(at[ours], chain.end_pos.ravel(), atol=EXACT)
    foot = human.J2.solids[4]  # from the arch to the ball
    np.testing.assert_allclose(at["foot_left"], foot.pos.ravel(), atol=EXACT)


@pytest.mark.parametrize("name", [name for names in ANGLES.values() for name in names if name is not None])
def test_every_angle_of_yeadons_moves_hands_feet_and_head_alike(name):
    person, configuration = measurements_of(1.75, 70.0), {name: 0.4}
    human = yeadon_person(person, configuration)
    at = positions(human18_from_measurements(person).with_pose(same_pose(person, configuration)))
    tips = {"A2": ("hand_left", 6), "B2": ("hand_right", 6), "J2": ("foot_left", 7), "K2": ("foot_right", 7)}
    for theirs, (ours, _) in tips.items():
        segment = getattr(human, theirs)
        along = at[ours] - segment.pos.ravel()
        np.testing.assert_allclose(np.cross(along, segment.rot_mat[:, 2]), 0, atol=ROUNDTRIP)
        assert along @ segment.rot_mat[:, 2] < -0.3
    crown = human.C.solids[-1].end_pos.ravel()
    along = at["head"] - at["neck"]
    np.testing.assert_allclose(np.cross(along, crown - at["neck"]), 0, atol=ROUNDTRIP)


FORWARD, BACKWARD, UP, DOWN, LEFT, RIGHT = (
    np.array(v, float) for v in ((0, -1, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0))
)
SIGNS = [  # movement, segment, axis, sign, landmark that moves, direction it moves in
    ("trunk flexion", "torso", 0, +1, "head", FORWARD),
    ("chest flexion", "chest", 0, +1, "head", FORWARD),
    ("neck flexion", "head", 0, +1, "head", FORWARD),
    ("hip flexion", "thigh_left", 0, -1, "knee_left", FORWARD),
    ("knee flexion", "shank_left", 0, +1, "ankle_left", BACKWARD),
    ("plantar flexion", "foot_left", 0, +1, "foot_left", DOWN),
    ("dorsiflexion", "foot_right", 0, -1, "foot_right", UP),
    ("shoulder flexion", "upper_arm_left", 0, -1, "elbow_left", FORWARD),
    ("elbow flexion", "forearm_right", 0, -1, "wrist_right", FORWARD),
    ("hip abduction, left", "thigh_left", 1, -1, "knee_left", LEFT),
    ("hip abduction, right", "thigh_right", 1, +1, "knee_right", RIGHT),
    ("shoulder abduction, left", "upper_arm_left", 1, -1, "elbow_left", LEFT),
    ("shoulder abduction, right", "upper_arm_right", 1, +1, "elbow_right", RIGHT),
    ("wrist flexion, left", "hand_left", 1, +1, "hand_left", RIGHT),
    ("wrist flexion, right", "hand_right", 1, -1, "hand_right", LEFT),
    ("shoulder raised, left", "shoulder_left", 1, -1, "shoulder_left", UP),
    ("shoulder raised, right", "shoulder_right", 1, +1, "shoulder_right", UP),
    ("shoulder forward, left", "shoulder_left", 2, -1, "shoulder_left", FORWARD),
    ("hip turned out, left", "thigh_left", 2, +1, "foot_left", LEFT),
    ("hip turned out, right", "thigh_right", 2, -1, "foot_right", RIGHT),
    ("chest turned left", "chest", 2, +1, "shoulder_right", FORWARD),
]


@pytest.mark.parametrize(("movement", "segment", "axis", "sign", "landmark", "direction"), SIGNS)
def test_joints_turn_the_way_their_limits_say(movement, segment, axis, sign, landmark, direction):
    angles = np.zeros(3)
    angles[axis] = sign * 15
    moved = positions(posed(**{segment: angles}))[landmark] - positions(posed())[landmark]
    assert moved @ direction > 0.5 * np.linalg.norm(moved) > 0.005
    model = human18()
    limits = model.segments[model.index_of(segment)].limits
    turned = matrix_from_angles(np.radians(10) * angles / 15)
    assert limits.slack(turned) > -np.radians(0.5), "the joint can do it"


CLINIC = [  # AAOS, Joint Motion (1965): x-y-z angles [deg] that healthy adults reach
    ("thigh_left", (-120, 0, 0)),
    ("thigh_left", (30, 0, 0)),
    ("thigh_left", (0, -40, 0)),
    ("thigh_left", (-90, 0, 45)),
    ("thigh_right", (-90, 0, -45)),
    ("shank_right", (0, 0, 0)),
    ("shank_right", (140, 0, 0)),
    ("forearm_left", (-150, 0, 0)),
    ("forearm_left", (-90, 0, 80)),
    ("foot_left", (-30, 0, 0)),
    ("foot_left", (50, 0, 0)),
    ("upper_arm_left", (-180, 0, 0)),
    ("upper_arm_left", (0, -180, 0)),
    ("upper_arm_right", (0, 180, 0)),
    ("upper_arm_left", (60, 0, 0)),
    ("upper_arm_left", (0, -90, 90)),
    ("upper_arm_left", (0, -90, -70)),
    ("upper_arm_right", (-90, 0, 0)),
]


@pytest.mark.parametrize(("segment", "angles_deg"), CLINIC)
def test_what_healthy_adults_reach_is_within_the_limits(segment, angles_deg):
    limits = (model := human18()).segments[model.index_of(segment)].limits
    assert limits.slack(matrix_from_angles(np.radians(angles_deg))) > -np.radians(1)


@pytest.mark.parametrize(
    ("segment", "angles_deg"),
    [
        ("shank_left", (-20, 0, 0)),
        ("forearm_right", (30, 0, 0)),
        ("upper_arm_left", (0, 90, 0)),
        ("foot_left", (90, 0, 0)),
    ],
)
def test_what_nobody_reaches_is_beyond_the_limits(segment, angles_deg):
    limits = (model := human18()).segments[model.index_of(segment)].limits
    assert limits.slack(matrix_from_angles(np.radians(angles_deg))) < -np.radians(10)


def test_the_zero_pose_is_well_within_the_limits():
    assert np.all(human18().limits.slack(np.eye(3)) > np.radians(3))


@pytest.mark.parametrize(
    ("stature", "mass", "expected"),
    [
        (180, 75, "stature_m is 180; expected 0.8 to 2.5 metres"),
        (1.8, 75000, "mass_kg is 75000; expected 10 to 300 kilograms"),
        (float("nan"), 75, "stature_m is nan"),
        (2.4, 20, "20 kg at 2.4 m means girths 0.33 times the average"),
    ],
)
def test_impossible_person_is_refused_in_one_line(stature, mass, expected):
    with pytest.raises(BodyError) as caught:
        human18(stature, mass)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)
