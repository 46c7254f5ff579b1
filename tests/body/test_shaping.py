"""Segments made longer and thicker, with all that hangs on them."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Inertia, Landmark, Mesh, Part, Pose, Segment, human18
from airborne.body.shaping import length_axis, stretch_mesh, with_girths, with_mass, with_segment_lengths, with_size
from airborne.errors import BodyError
from tests.support.tolerances import EXACT, ROUNDTRIP

UPRIGHT = Pose(world_from_root=RigidTransform.identity())


def positions(model):
    return dict(zip([mark.name for mark in model.landmarks], model.with_pose(UPRIGHT).landmarks, strict=True))


def segment(model, name):
    return model.segments[model.index_of(name)]


def same_model(a, b, tolerance=EXACT):
    for s, u in zip(a.segments, b.segments, strict=True):
        np.testing.assert_allclose(s.joint_m, u.joint_m, atol=tolerance)
        np.testing.assert_allclose(s.inertia.mass_kg, u.inertia.mass_kg, rtol=tolerance)
        np.testing.assert_allclose(s.inertia.centre_m, u.inertia.centre_m, atol=tolerance)
        np.testing.assert_allclose(s.inertia.tensor_kg_m2, u.inertia.tensor_kg_m2, atol=tolerance)
        for p, q in zip(s.parts, u.parts, strict=True):
            assert p.name == q.name
            np.testing.assert_allclose(p.shape.semi_axes_m, q.shape.semi_axes_m, atol=tolerance)
            np.testing.assert_allclose(p.slab_m, q.slab_m, atol=tolerance)
            np.testing.assert_allclose(p.segment_from_part.as_matrix(), q.segment_from_part.as_matrix(), atol=tolerance)
    for m, n in zip(a.landmarks, b.landmarks, strict=True):
        np.testing.assert_allclose(m.position_m, n.position_m, atol=tolerance)


EVERY = {s: 1.3 for s in ("pelvis", "torso", "chest", "head", "shoulder", "upper_arm", "forearm", "hand", "foot")}


def test_no_scale_and_scale_one_change_nothing():
    for change in (with_segment_lengths, with_girths):
        same_model(change(human18(), {}), human18())
        same_model(change(human18(), dict.fromkeys(EVERY, 1.0)), human18())


@pytest.mark.parametrize("change", [with_segment_lengths, with_girths])
def test_a_scale_is_undone_by_its_inverse_and_two_are_their_product(change):
    model = human18()
    there = change(model, EVERY)
    same_model(change(there, {name: 1 / scale for name, scale in EVERY.items()}), model)
    same_model(change(there, {"thigh": 0.9, "hand": 1.1}), change(model, EVERY | {"thigh": 0.9, "hand": 1.43}))


def test_a_larger_body_is_larger_in_all_directions_and_heavier_at_constant_density():
    model, larger = human18(), with_size(human18(), 1.2)
    for name, at in positions(model).items():
        np.testing.assert_allclose(positions(larger)[name], 1.2 * at, atol=EXACT)
    thigh, own = segment(larger, "thigh_left").inertia, segment(model, "thigh_left").inertia
    np.testing.assert_allclose(thigh.mass_kg, 1.2**3 * own.mass_kg)
    np.testing.assert_allclose(thigh.tensor_kg_m2, 1.2**5 * own.tensor_kg_m2)
    same_model(with_size(larger, 1 / 1.2), model)
    with pytest.raises(BodyError, match="size is 20 times the body's"):
        with_size(model, 20)


def test_a_longer_thigh_lowers_knee_and_foot_and_nothing_else():
    model, before = human18(), positions(human18())
    after = positions(with_segment_lengths(model, {"thigh_left": 1.1}))
    drop = 0.1 * (before["hip_left"][2] - before["knee_left"][2])
    for name in ("knee_left", "ankle_left", "foot_left"):
        np.testing.assert_allclose(after[name], before[name] - [0, 0, drop], atol=EXACT)
    for name in set(before) - {"knee_left", "ankle_left", "foot_left"}:
        np.testing.assert_allclose(after[name], before[name], atol=EXACT)


def test_every_segment_grows_along_its_own_length():
    axes = {s.name: length_axis(human18(), s.name) for s in human18().segments}
    assert {name for name, axis in axes.items() if axis == 1} == {"foot_left", "foot_right"}
    assert {name for name, axis in axes.items() if axis == 0} == {"shoulder_left", "shoulder_right"}
    before, after = positions(human18()), positions(with_segment_lengths(human18(), {"shoulder": 1.2}))
    assert after["shoulder_left"][0] > before["shoulder_left"][0] > 0 > before["hand_right"][0] > after["hand_right"][0]
    assert after["head"] == pytest.approx(before["head"])


def test_a_name_without_its_side_is_both_and_one_with_it_goes_first():
    model = with_segment_lengths(human18(), {"thigh_right": 1.2, "thigh": 1.1})
    usual = segment(human18(), "shank_left").joint_m[2]
    assert segment(model, "shank_left").joint_m[2] == pytest.approx(1.1 * usual, rel=EXACT)
    assert segment(model, "shank_right").joint_m[2] == pytest.approx(1.2 * usual, rel=EXACT)


def test_a_border_stays_at_its_share_of_a_longer_segment():
    model = with_segment_lengths(human18(), {"thigh": 1.25, "head": 1.25})
    for name in ("thigh_left", "head"):
        part, was = segment(model, name).parts[1], segment(human18(), name).parts[1]
        height, before = (p.segment_from_part.apply([0, 0, p.slab_m[0]]) for p in (part, was))
        np.testing.assert_allclose(height, before * [1, 1, 1.25], atol=EXACT)


def test_girth_widens_ellipsoids_and_leaves_every_joint():
    model, thick = human18(), with_girths(human18(), {"torso": 1.2, "foot": 1.1, "head": 1.1})
    assert positions(thick).keys() == positions(model).keys()
    for name, place in positions(model).items():
        np.testing.assert_allclose(positions(thick)[name], place, atol=EXACT)
    for name, factors in {"torso": [1.2, 1.2, 1], "foot_left": [1.1, 1, 1.1], "head": [1.1, 1, 1.1]}.items():
        ratio = segment(thick, name).parts[0].shape.semi_axes_m / segment(model, name).parts[0].shape.semi_axes_m
        np.testing.assert_allclose(ratio, factors, atol=ROUNDTRIP)  # the head's part has its z backward


def test_inertia_is_that_of_the_stretched_solid():
    rng = np.random.default_rng(4)
    mass, place = rng.uniform(0.5, 1, 30), rng.normal(size=(30, 3))

    def inertia(mass, place):
        centre = mass @ place / mass.sum()
        spread = (place - centre).T @ ((place - centre) * mass[:, None])
        return Inertia(float(mass.sum()), centre, np.trace(spread) * np.eye(3) - spread)

    part = Part("rod", Ellipsoid(np.array([0.1, 0.1, 0.5])), RigidTransform.identity(), None)
    tip = (Landmark("tip", "rod", np.array([0, 0, 1.0])),)

    def model(own):
        return BodyModel("rod", (Segment("rod", None, np.zeros(3), (part,), inertia=own),), tip)

    for change, factors in ((with_segment_lengths, [1, 1, 1.4]), (with_girths, [1.4, 1.4, 1])):
        found = change(model(inertia(mass, place)), {"rod": 1.4}).segments[0].inertia
        expected = inertia(mass * np.prod(factors), place * factors)
        assert found.mass_kg == pytest.approx(expected.mass_kg, rel=EXACT)
        np.testing.assert_allclose(found.tensor_kg_m2, expected.tensor_kg_m2, rtol=ROUNDTRIP, atol=ROUNDTRIP)
        kept = inertia(mass, place).centre_m
        np.testing.assert_allclose(found.centre_m, kept if change is with_girths else expected.centre_m, atol=ROUNDTRIP)


def test_normals_of_a_stretched_mesh_stand_on_it():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    vertices, turn = np.asarray(ball.vertices, float), Rotation.from_rotvec([0.3, -0.8, 0.5])
    mesh = Mesh(vertices, np.asarray(ball.faces, np.int64), vertices / 0.1)
    factors = np.array([0.7, 1.4, 1.1])
    stretched = stretch_mesh(mesh, factors, turn.as_matrix())
    local = turn.apply(stretched.vertices_m)
    np.testing.assert_allclose(local, turn.apply(vertices) * factors, atol=1e-12)
    gradient = local / factors**2  # of the ellipsoid
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(turn.apply(stretched.normals), gradient, atol=1e-12)


def test_boxes_and_meshes_stretch_and_oblique_boxes_are_refused():
    quarter, oblique = Rotation.from_euler("y", 90, degrees=True), Rotation.from_euler("y", 20, degrees=True)
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.1)

    def stick(shape, rotation):
        place = RigidTransform.from_components([0, 0, 0.5], rotation)
        tip = (Landmark("tip", "bar", np.array([0, 0, 1.0])),)
        return BodyModel("stick", (Segment("bar", None, np.zeros(3), (Part("bar", shape, place, None),)),), tip)

    (box,) = with_segment_lengths(stick(Box(np.array([1.0, 0.1, 0.2])), quarter), {"bar": 2.0}).parts
    np.testing.assert_allclose(box.shape.size_m, [2, 0.1, 0.2], atol=ROUNDTRIP)
    np.testing.assert_allclose(box.segment_from_part.translation, [0, 0, 1], atol=EXACT)
    mesh = Mesh(np.asarray(ball.vertices, float), np.asarray(ball.faces, np.int64))
    (part,) = with_segment_lengths(stick(mesh, oblique), {"bar": 2.0}).parts
    before = RigidTransform.from_components([0, 0, 0.5], oblique).apply(mesh.vertices_m)
    np.testing.assert_allclose(part.segment_from_part.apply(part.shape.vertices_m), before * [1, 1, 2], atol=EXACT)
    with pytest.raises(BodyError, match="part 'bar' is oblique"):
        with_segment_lengths(stick(Box(np.array([1.0, 0.1, 0.2])), oblique), {"bar": 2.0})


@pytest.mark.parametrize("change", [with_segment_lengths, with_girths])
def test_unknown_segments_and_factors_that_are_none_are_refused(change):
    with pytest.raises(BodyError, match="has no segment 'leg'; it has: pelvis, torso"):
        change(human18(), {"leg": 1.1})
    for scale in (0.0, -1.0, 110.0, float("nan")):
        with pytest.raises(BodyError, match=r"segment 'thigh': scale is .*; expected a factor"):
            change(human18(), {"thigh": scale})


def test_width_and_depth_scale_apart():
    body = with_girths(human18(), {"torso": (1.2, 0.9), "foot": (1.1, 1.0)})
    ratio = segment(body, "torso").parts[0].shape.semi_axes_m / segment(human18(), "torso").parts[0].shape.semi_axes_m
    np.testing.assert_allclose(ratio, (1.2, 0.9, 1.0), rtol=EXACT)
    feet = [segment(each, "foot_left").parts[0].shape.semi_axes_m for each in (body, human18())]
    np.testing.assert_allclose(feet[0] / feet[1], (1.1, 1.0, 1.0), rtol=EXACT)
    same_model(with_girths(human18(), {"torso": (1.2, 1.2)}), with_girths(human18(), {"torso": 1.2}))


def test_a_total_mass_is_shared_out_as_before():
    body = with_mass(human18(), 100.0)
    assert sum(s.inertia.mass_kg for s in body.segments) == pytest.approx(100.0)
    same_model(with_mass(body, 75.0), with_mass(human18(), 75.0))
    ratio = segment(body, "head").inertia.tensor_kg_m2 / segment(human18(), "head").inertia.mass_kg
    expected = segment(human18(), "head").inertia.tensor_kg_m2 / segment(human18(), "head").inertia.mass_kg
    scale = segment(body, "head").inertia.mass_kg / segment(human18(), "head").inertia.mass_kg
    np.testing.assert_allclose(ratio, expected * scale)


@pytest.mark.parametrize("mass_kg", [0.0, -3.0, np.inf])
def test_an_impossible_mass_is_refused(mass_kg):
    with pytest.raises(BodyError, match="mass_kg"):
        with_mass(human18(), mass_kg)
