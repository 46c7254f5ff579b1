"""The skin is another surface over the same skeleton: closed, human-sized, mirrored, in the same colours."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree
from scipy.spatial.transform import RigidTransform

from airborne.body import ATHLETE, SAMPLED, BodyModel, Pose, human18, human18_from_measurements, surface_arrays
from airborne.body.anthropometry import measurements_of
from airborne.body.shaping import with_girths, with_segment_lengths
from airborne.body.skin import skin_of, stretch_skin
from airborne.body.stadia import stadium
from airborne.cameras import Camera
from airborne.errors import BodyError
from airborne.rendering import FLAT, render
from tests.support.motions import figure
from tests.support.tolerances import EXACT, ROUNDTRIP

PERSON = human18(1.80, 75.0)
PLAIN = skin_of(PERSON, radius_change=0, border_change_m=0)
SIDES = [name.removesuffix("_left") for name in (s.name for s in PERSON.segments) if name.endswith("_left")]
WIDEST = 0.08


def segment(model, name):
    return model.segments[model.index_of(name)]


def solid(part_of):
    """A segment's parts put together again."""
    pieces = [trimesh.Trimesh(p.shape.vertices_m, p.shape.faces, process=False) for p in part_of.parts]
    whole = trimesh.util.concatenate(pieces)
    whole.merge_vertices(digits_vertex=9, merge_norm=True)
    return whole


def widths_at(part_of, height):
    """Full widths along x and y of a segment at a height."""
    return np.ptp(solid(part_of).section([0, 0, 1], [0, 0, height]).bounds[:, :2], axis=0)


def masks(model, *, turn):
    posed = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    view = np.array([[np.cos(turn), np.sin(turn), 0], [0, 0, -1], [-np.sin(turn), np.cos(turn), 0]])
    place = RigidTransform.from_matrix(
        np.block([[view, np.array([[0], [0], [5.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])
    )
    K = np.array([[600.0, 0, 100], [0, 600, 150], [0, 0, 1]])
    return render(surface_arrays(model), posed, Camera(name="c", K=K, size=(201, 301), camera_from_world=place), FLAT)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_every_segment_is_closed_and_faces_outward(seed):
    for each in skin_of(PERSON, seed=seed).segments:
        whole = solid(each)
        assert whole.is_watertight and whole.is_winding_consistent and whole.volume > 0, each.name
        for part in each.parts:
            faces = trimesh.Trimesh(part.shape.vertices_m, part.shape.faces, process=False)
            normals = part.shape.normals[part.shape.faces].mean(axis=1)
            is_wide = faces.area_faces > 1e-7
            assert np.all(np.sum(normals * faces.face_normals, axis=1)[is_wide] > 0.5), part.name


def test_skeleton_masses_landmarks_and_colours_are_the_model_s_own():
    skin = skin_of(PERSON, seed=4)
    assert skin.landmarks == PERSON.landmarks
    for ours, theirs in zip(skin.segments, PERSON.segments, strict=True):
        assert (ours.name, ours.parent, ours.inertia) == (theirs.name, theirs.parent, theirs.inertia)
        np.testing.assert_array_equal(ours.joint_m, theirs.joint_m)
        np.testing.assert_array_equal(ours.limits.half_rad, theirs.limits.half_rad)
        assert [part.name for part in ours.parts] == [part.name for part in theirs.parts]
        for a, b in zip(ours.parts, theirs.parts, strict=True):
            np.testing.assert_array_equal(a.colour, b.colour)


@pytest.mark.parametrize("seed", [0, 5])
def test_right_is_left_in_a_mirror(seed):
    skin = skin_of(PERSON, seed=seed)
    for name in SIDES:
        left, right = solid(segment(skin, f"{name}_left")), solid(segment(skin, f"{name}_right"))
        mirrored = right.vertices * [-1, 1, 1]
        distance = KDTree(mirrored).query(left.vertices)[0]
        assert distance.max() < 1e-8, name


def test_right_follows_its_own_measurements_where_they_differ():
    person = measurements_of(1.8, 75.0)
    thicker = replace(person, values_m={**person.values_m, "Lk4p": 1.1 * person.values_m["Lk4p"]})
    model = human18_from_measurements(thicker, symmetric=False)
    skin = skin_of(model, measurements=thicker, radius_change=0, border_change_m=0)
    calf = person.values_m["Lj3L"] - person.values_m["Lj4L"]
    left, right = (widths_at(segment(skin, f"shank_{side}"), calf) for side in ("left", "right"))
    np.testing.assert_allclose(right / left, 1.1, atol=0.01)


@pytest.mark.parametrize(
    ("name", "level"),
    [("pelvis", 0), ("pelvis", 1), ("torso", 2), ("chest", 3)],
)
def test_trunk_has_the_measured_width_and_depth_at_its_levels(name, level):
    v = measurements_of(1.8, 75.0).values_m
    origin = {"pelvis": v["Ls2L"], "torso": v["Ls2L"], "chest": v["Ls3L"]}[name]
    at = ([0.0, v["Ls1L"], v["Ls2L"], v["Ls3L"]][level]) - origin
    section = stadium(v[f"Ls{level}p"], v[f"Ls{level}w"])
    expected = 2 * np.array([section.flat_m + section.radius_m, section.radius_m])
    np.testing.assert_allclose(widths_at(segment(PLAIN, name), at), expected, rtol=0.02)


@pytest.mark.parametrize(
    ("name", "key", "at"), [("thigh", "Lj1p", "Lj1L"), ("thigh", "Lj3p", "Lj3L"), ("upper_arm", "La2p", "La2L")]
)
def test_limbs_have_the_measured_girths(name, key, at):
    v = measurements_of(1.8, 75.0).values_m
    whole = solid(segment(PLAIN, f"{name}_left"))
    section = whole.section(plane_origin=[0, 0, -v[at]], plane_normal=[0, 0, 1])
    assert section.length == pytest.approx(v[key], rel=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_girths_differ_by_up_to_the_share_asked_for_and_centres_not_at_all(seed):
    skin = skin_of(PERSON, seed=seed, radius_change=WIDEST, border_change_m=0)
    ratios = []
    for name in ("pelvis", "torso", "thigh_left", "shank_left", "forearm_left", "upper_arm_left"):
        solids = [solid(segment(model, name)) for model in (skin, PLAIN)]
        low, high = solids[1].bounds[:, 2]
        for height in np.linspace(0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high, 5):
            changed, plain = (each.section([0, 0, 1], [0, 0, height]) for each in solids)
            ratios.append(changed.length / plain.length)
            np.testing.assert_allclose(changed.bounds.mean(axis=0), plain.bounds.mean(axis=0), atol=1e-3)
    assert np.abs(np.array(ratios) - 1).max() < WIDEST + 0.01
    assert np.ptp(ratios) > 0.02


def test_borders_move_with_the_seed_by_up_to_the_length_asked_for():
    def border(model, name):
        low, high = segment(model, name).parts
        heights = [part.segment_from_part.apply(part.shape.vertices_m)[:, 2] for part in (low, high)]
        assert heights[0].max() == pytest.approx(heights[1].min(), abs=ROUNDTRIP)
        return heights[0].max()

    moved = [skin_of(PERSON, seed=seed, border_change_m=0.02) for seed in range(6)]
    for name in ("upper_arm_left", "thigh_left", "shank_left"):
        own = segment(PERSON, name).parts[0]
        planned = own.segment_from_part.translation[2] + own.slab_m[1]
        assert border(PLAIN, name) == pytest.approx(planned, abs=ROUNDTRIP)
        moves = [border(skin, name) - planned for skin in moved]
        assert 0.005 < np.abs(moves).max() <= 0.02


def test_same_seed_gives_the_same_person_and_another_seed_another():
    first, again, other = (skin_of(PERSON, seed=seed) for seed in (7, 7, 8))
    for a, b in zip(first.parts, again.parts, strict=True):
        np.testing.assert_array_equal(a.shape.vertices_m, b.shape.vertices_m)
    assert not np.array_equal(first.parts[0].shape.vertices_m, other.parts[0].shape.vertices_m)


@pytest.mark.parametrize("turn", [0.0, np.pi / 2])
def test_outlines_of_skin_and_ellipsoids_cover_about_the_same(turn):
    ellipsoids, skin = masks(PERSON, turn=turn), masks(PLAIN, turn=turn)
    assert ellipsoids.mask.sum() > 4000
    assert skin.mask.sum() == pytest.approx(ellipsoids.mask.sum(), rel=WIDEST)
    both = ellipsoids.mask & skin.mask
    assert both.sum() / (ellipsoids.mask | skin.mask).sum() > 0.85
    assert np.mean(skin.segment[both] == ellipsoids.segment[both]) > 0.85
    centre, other = (np.argwhere(each.mask).mean(axis=0) for each in (ellipsoids, skin))
    assert abs(centre[1] - other[1]) < 0.8  # px, of 8 mm: not before or behind, not beside


def test_zero_pose_has_no_gap_from_neck_to_sole():
    mask = masks(skin_of(PERSON, seed=2), turn=0.0).mask
    rows = np.nonzero(mask.any(axis=1))[0]
    assert len(rows) == rows[-1] - rows[0] + 1 > 200


def test_a_segment_in_one_colour_is_one_closed_mesh_and_unsampled_colours_stay_so():
    outfit = replace(ATHLETE, hair_share=0.0, sleeve_share=1.0, shorts_share=1.0, socks_share=0.0)
    for part in skin_of(human18(outfit=outfit)).parts:
        assert trimesh.Trimesh(part.shape.vertices_m, part.shape.faces, process=False).is_watertight
    assert skin_of(human18(outfit=SAMPLED)).needs_colours


@pytest.mark.parametrize(("stature", "mass"), [(1.55, 48.0), (2.02, 105.0), (1.40, 33.0)])
def test_every_person_can_have_a_skin_as_tall_as_his_bones(stature, mass):
    model = human18(stature, mass)
    posed = skin_of(model, seed=1).with_pose(Pose(world_from_root=RigidTransform.identity()))
    heights = [
        (R @ part.shape.vertices_m.T)[2] + t[2]
        for each, R, t in zip(posed.model.segments, posed.R, posed.t, strict=True)
        for part in each.parts
    ]
    assert np.ptp(np.concatenate(heights)) == pytest.approx(stature, rel=0.01)


def test_errors_for_other_bodies_name_what_is_missing():
    ball = BodyModel("ball", (replace(PERSON.segments[0], inertia=None),), ())
    with pytest.raises(BodyError, match="no human18"):
        skin_of(ball)
    with pytest.raises(BodyError, match="give the measurements it was made of"):
        skin_of(PERSON, measurements=measurements_of(1.7, 75.0))
    joints = tuple(replace(s, joint_m=s.joint_m * [1.2, 1, 1]) for s in PERSON.segments)
    with pytest.raises(BodyError, match="joints lie up to"):
        skin_of(replace(PERSON, segments=joints))
    np.testing.assert_allclose(PERSON.segments[0].joint_m, 0, atol=EXACT)


def test_skin_stretches_with_the_body():
    def other(model):
        model = with_segment_lengths(model, {"thigh": 1.1, "torso": 0.94, "foot": 0.9})
        return with_girths(model, {"shank": 1.2, "chest": (1.1, 0.9), "head": (0.95, 1.05), "foot": 1.1})

    stretched, of_base = stretch_skin(other(human18())), other(stretch_skin(human18()))
    assert stretched is not None
    for found, expected in zip(stretched.segments, of_base.segments, strict=True):
        np.testing.assert_allclose(found.joint_m, expected.joint_m, atol=EXACT)
        for own, part in zip(found.parts, expected.parts, strict=True):
            np.testing.assert_allclose(own.shape.vertices_m, part.shape.vertices_m, atol=ROUNDTRIP)
            np.testing.assert_allclose(own.shape.normals, part.shape.normals, atol=0.02)  # cut before or after


def test_skin_of_another_stature_is_about_as_thick_as_its_ellipsoids():
    body = human18(1.65, 80.0)
    drawn = [masks(each, turn=0.5).mask for each in (body, stretch_skin(body))]
    assert np.sum(drawn[0] ^ drawn[1]) < 0.15 * drawn[0].sum()


@pytest.mark.parametrize("body", [PLAIN, figure()], ids=["of meshes", "of other segments"])
def test_a_body_of_other_segments_or_shapes_has_no_such_skin(body):
    assert stretch_skin(body) is None
