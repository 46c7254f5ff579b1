"""Body files: what is read, and what is refused in one line."""

import re

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import (
    SAMPLED,
    BodyModel,
    Box,
    Ellipsoid,
    Inertia,
    Landmark,
    Mesh,
    Part,
    Segment,
    human18,
    surface_arrays,
)
from airborne.body.files import body_toml, find_mesh_files, read_body, write_body
from airborne.body.limits import JointLimits
from airborne.errors import BodyError
from tests.support.tolerances import EXACT

GOOD = """
name = "leg"
[[segment]]
name = "thigh"
[[segment.part]]
name = "upper"
shape = "box"
size_m = [0.1, 0.2, 0.4]
centre_m = [0.0, 0.01, -0.2]
rotation_deg = [10.0, 20.0, 30.0]
colour_srgb = [10, 20, 30]
[[segment]]
name = "shank"
parent = "thigh"
joint_m = [0.0, 0.0, -0.4]
[[segment.part]]
name = "lower"
shape = "ellipsoid"
semi_axes_m = [0.05, 0.06, 0.2]
colour = "sample"
"""
FULL = (
    GOOD.replace(
        "joint_m = [0.0, 0.0, -0.4]", "joint_m = [0.0, 0.0, -0.4]\nlimits_deg = [[-5, 140], [0, 0], [-inf, 10]]"
    )
    + """slab_m = [-inf, 0.05]
[segment.inertia]
mass_kg = 3.5
centre_m = [0.0, 0.01, -0.17]
tensor_kg_m2 = [[0.05, 0.0, 0.0], [0.0, 0.05, 0.001], [0.0, 0.001, 0.01]]
[[landmark]]
name = "knee"
segment = "shank"
[[landmark]]
name = "ankle"
segment = "shank"
position_m = [0.0, 0.0, -0.4]
"""
)
MESH = """
name = "lump"
[[segment]]
name = "root"
[[segment.part]]
name = "lump"
shape = "mesh"
file = "FILE"
colour_srgb = [10, 20, 30]
"""


def read(tmp_path, text):
    path = tmp_path / "body.toml"
    path.write_text(text, encoding="utf-8")
    return read_body(path)


def complaint(tmp_path, text):
    with pytest.raises(BodyError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_file_holds_segments_parts_positions_and_colours(tmp_path):
    model = read(tmp_path, GOOD)
    assert model.name == "leg"
    assert [s.name for s in model.segments] == ["thigh", "shank"]
    np.testing.assert_array_equal(model.parents, [-1, 0])
    np.testing.assert_array_equal(model.segments[1].joint_m, [0, 0, -0.4])
    upper, lower = model.parts
    assert isinstance(upper.shape, Box) and isinstance(lower.shape, Ellipsoid)
    np.testing.assert_array_equal(upper.shape.size_m, [0.1, 0.2, 0.4])
    np.testing.assert_array_equal(upper.segment_from_part.translation, [0, 0.01, -0.2])
    turns = [
        Rotation.from_rotvec(np.radians(angle) * axis) for angle, axis in zip((10, 20, 30), np.eye(3), strict=True)
    ]
    expected = turns[0] * turns[1] * turns[2]
    np.testing.assert_allclose(upper.segment_from_part.rotation.as_matrix(), expected.as_matrix(), atol=EXACT)
    np.testing.assert_array_equal(upper.colour, [10, 20, 30])
    np.testing.assert_array_equal(lower.shape.semi_axes_m, [0.05, 0.06, 0.2])
    assert lower.colour is None


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('name = "leg"', 'name = "leg"\nheight = 3', "height: unknown key"),
        ('name = "leg"', "", "name is missing"),
        ("centre_m", "center_m", "part 'upper': center_m: unknown key; did you mean centre_m?"),
        ("size_m = [0.1, 0.2, 0.4]", "size_m = [0.1, -0.2, 0.4]", "part 'upper': size_m is [0.1, -0.2, 0.4]"),
        (
            "size_m = [0.1, 0.2, 0.4]",
            "size_m = [0.1, 0.2, nan]",
            "part 'upper': size_m, value 3: expected a finite",
        ),
        ("size_m = [0.1, 0.2, 0.4]", "size_m = [0.1, 0.2]", "segment 'thigh': part 'upper': size_m"),
        ("size_m = [0.1, 0.2, 0.4]", "", "part 'upper' is a box and needs size_m"),
        ("size_m = [0.1, 0.2, 0.4]", "semi_axes_m = [1, 1, 1]", "part 'upper' is a box and needs size_m"),
        ("semi_axes_m = [0.05, 0.06, 0.2]", 'semi_axes_m = [1, 1, 1]\nfile = "a.obj"', "file does not belong to it"),
        ("semi_axes_m = [0.05, 0.06, 0.2]", "semi_axes_m = [1, 0, 1]", "part 'lower': semi_axes_m is [1.0, 0.0, 1.0]"),
        ('shape = "box"', 'shape = "cone"', "part 'upper': shape"),
        ("colour_srgb = [10, 20, 30]", "", "part 'upper' needs colour_srgb"),
        ('colour = "sample"', 'colour = "sample"\ncolour_srgb = [1, 2, 3]', "part 'lower' needs colour_srgb"),
        ("colour_srgb = [10, 20, 30]", "colour_srgb = [10, 20, 256]", "colour_srgb, value 3"),
        (
            "colour_srgb = [10, 20, 30]",
            "colour_srgb = [0.8, 0.2, 0]",
            "part 'upper': colour_srgb looks like shares of 1",
        ),
        ("colour_srgb = [10, 20, 30]", "colour_srgb = [10, 20]", "part 'upper': colour_srgb"),
        ('colour = "sample"', 'colour = "guess"', "part 'lower': colour"),
        ('parent = "thigh"', 'parent = "hip"', "parent 'hip' must stand before it; so far: thigh"),
        ('parent = "thigh"', "", "exactly the first segment has no parent"),
        ('name = "shank"', 'name = "thigh"', "two segments are named 'thigh'"),
        ("centre_m = [0.0, 0.01, -0.2]", "centre_m = [0.0, nan, -0.2]", "centre_m"),
        ("rotation_deg = [10.0, 20.0, 30.0]", "rotation_deg = [10.0, inf, 30.0]", "rotation_deg"),
        ("joint_m = [0.0, 0.0, -0.4]", "joint_m = [0.0, 0.0, inf]", "joint_m"),
        ("[[segment]]", "[[segment", "not a TOML file"),
    ],
)
def test_malformed_file_is_refused_in_one_line_that_names_it_and_the_fault(tmp_path, old, new, expected):
    assert old in GOOD
    message = complaint(tmp_path, GOOD.replace(old, new, 1))
    assert message.startswith("body.toml: ")
    assert expected in message


def test_file_without_segments_is_refused(tmp_path):
    assert "segment" in complaint(tmp_path, 'name = "a"\nsegment = []')
    assert "is no body file: it has no [[segment]] (found nothing)" in complaint(tmp_path, "")


def test_body_without_parts_is_refused(tmp_path):
    assert "has no part to see" in complaint(tmp_path, 'name = "a"\n[[segment]]\nname = "root"')


def test_missing_binary_or_foreign_file_is_refused(tmp_path):
    with pytest.raises(BodyError, match=r"none\.toml: cannot be read \(No such file or directory\)"):
        read_body(tmp_path / "none.toml")
    with pytest.raises(BodyError, match="cannot be read"):
        read_body(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    with pytest.raises(BodyError, match=r"binary\.toml: not a TOML file"):
        read_body(binary)


@pytest.mark.parametrize("kind", ["obj", "ply", "stl"])
def test_mesh_file_of_each_kind_is_read(tmp_path, kind):
    lump = trimesh.creation.box((0.2, 0.4, 0.6))
    lump.export(tmp_path / f"lump.{kind}")
    model = read(tmp_path, MESH.replace("FILE", f"lump.{kind}"))
    shape = model.parts[0].shape
    assert isinstance(shape, Mesh)
    assert len(shape.faces) == 12
    np.testing.assert_allclose(np.ptp(shape.vertices_m, axis=0), [0.2, 0.4, 0.6], atol=1e-6)


def test_mesh_in_other_units_is_scaled_to_metres(tmp_path):
    trimesh.creation.box((200, 400, 600)).export(tmp_path / "lump.obj")
    model = read(tmp_path, MESH.replace("FILE", "lump.obj") + "scale = 0.001\n")
    np.testing.assert_allclose(np.ptp(model.parts[0].shape.vertices_m, axis=0), [0.2, 0.4, 0.6], atol=1e-6)
    assert "scale" in complaint(tmp_path, MESH.replace("FILE", "lump.obj") + "scale = 0\n")


def test_mesh_with_inward_faces_is_flipped_outward(tmp_path):
    lump = trimesh.creation.box((0.2, 0.4, 0.6))
    lump.invert()
    lump.export(tmp_path / "lump.obj")
    flat = surface_arrays(read(tmp_path, MESH.replace("FILE", "lump.obj")))
    middles = flat.corners.reshape(-1, 3, 3).mean(axis=1)
    assert np.all(np.einsum("ij,ij->i", flat.normals, middles) > 0)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("lump.obj", None, "mesh file lump.obj not found beside the body file"),
        ("lump.obj", b"", "lump.obj: "),
        ("lump.stl", b"", "lump.stl: "),
        ("lump.ply", bytes(range(256)), "lump.ply: "),
        ("lump.obj", b"v 0 0 0\nv 1 0 0\n", "lump.obj: "),
        ("lump.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "lump.obj: "),
        ("lump.xyz", b"0 0 0\n1 0 0\n", "lump.xyz: "),
    ],
)
def test_unusable_mesh_file_is_refused_in_one_line(tmp_path, name, content, expected):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert expected in complaint(tmp_path, MESH.replace("FILE", name))


@pytest.mark.parametrize("name", ["../ball.stl", "/ball.stl"])
def test_mesh_file_elsewhere_is_refused(tmp_path, name):
    path = tmp_path / "body.toml"
    path.write_text(
        f'name = "ball"\n[[segment]]\nname = "ball"\n[[segment.part]]\nname = "ball"\nshape = "mesh"\nfile = "{name}"\n'
        'colour = "sample"\n'
    )
    with pytest.raises(BodyError, match="must lie beside the body file or below it"):
        read_body(path)


def test_open_mesh_is_refused(tmp_path):
    box = trimesh.creation.box(extents=[0.1, 0.2, 0.3])
    box.update_faces(np.arange(len(box.faces)) > 2)
    box.export(tmp_path / "lump.obj")
    assert "lump.obj: the mesh is not closed" in complaint(tmp_path, MESH.replace("FILE", "lump.obj"))


def test_a_mesh_with_a_few_bad_edges_is_taken_with_a_note_that_counts_and_places_them(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    hole = ball.triangles_center[0]
    ball.update_faces(np.arange(len(ball.faces)) > 0)
    ball.export(tmp_path / "lump.obj")
    (note,) = read(tmp_path, MESH.replace("FILE", "lump.obj")).notes
    assert note.startswith("lump.obj: 3 of 1920 edges do not have two faces, at (")
    places = np.array([[float(x) for x in each.split(",")] for each in re.findall(r"\(([^)]*)\)", note)])
    assert np.linalg.norm(places - hole, axis=1).max() < 0.02
    trimesh.creation.icosphere(subdivisions=3, radius=0.1).export(tmp_path / "lump.obj")
    assert read(tmp_path, MESH.replace("FILE", "lump.obj")).notes == ()


def test_measures_in_millimetres_are_noticed(tmp_path):
    trimesh.creation.box(extents=[100, 200, 300]).export(tmp_path / "lump.stl")
    assert "0.001 if it is in millimetres" in complaint(tmp_path, MESH.replace("FILE", "lump.stl"))
    with pytest.raises(BodyError, match="is it in mm or cm"):
        Box(np.array([60.0, 900.0, 45.0]))


def test_file_says_limits_slabs_inertia_and_landmarks(tmp_path):
    thigh, shank = (model := read(tmp_path, FULL)).segments
    assert not thigh.limits.is_limited
    np.testing.assert_allclose(shank.limits.half_rad, np.radians([72.5, 0, 95]), atol=EXACT)
    np.testing.assert_allclose(shank.limits.centre_angles_rad, np.radians([67.5, 0, -85]), atol=EXACT)
    assert model.notes == ("body: limits_deg of shank are read as a swing and a twist",)
    assert shank.parts[0].slab_m == (-np.inf, 0.05)
    assert thigh.inertia is None
    assert shank.inertia.mass_kg == 3.5
    np.testing.assert_array_equal(shank.inertia.centre_m, [0, 0.01, -0.17])
    np.testing.assert_array_equal(shank.inertia.tensor_kg_m2, [[0.05, 0, 0], [0, 0.05, 0.001], [0, 0.001, 0.01]])
    assert [(mark.name, mark.segment) for mark in model.landmarks] == [("knee", "shank"), ("ankle", "shank")]
    np.testing.assert_array_equal(model.landmarks[1].position_m, [0, 0, -0.4])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[[-5, 140], ", "[[140, -5], ", "segment 'shank': each joint limit needs a least and a greatest angle"),
        ("[[-5, 140], ", "[[nan, 140], ", "segment 'shank': each joint limit needs a least and a greatest angle"),
        ("[[-5, 140], ", "[", "segment 'shank': limits_deg"),
        ("[[-5, 140], ", "[[-5], ", "segment 'shank': limits_deg, value 1"),
        ("slab_m = [-inf, 0.05]", "slab_m = [0.05, -0.05]", "part 'lower': slab_m is [0.05, -0.05]"),
        ("slab_m = [-inf, 0.05]", "slab_m = [nan, 0.05]", "part 'lower': slab_m"),
        ("slab_m = [-inf, 0.05]", "slab_m = [0.05]", "slab_m"),
        ("rotation_deg = [10", "slab_m = [0, 0.1]\nrotation_deg = [10", "part 'upper': only an ellipsoid can be cut"),
        ("mass_kg = 3.5", "mass_kg = 0", "segment 'shank': inertia.mass_kg"),
        ("mass_kg = 3.5", "", "inertia.mass_kg is missing"),
        ("[[0.05, 0.0, 0.0], ", "[[0.05, 0.01, 0.0], ", "segment 'shank': tensor_kg_m2 belongs to no solid"),
        ("[[0.05, 0.0, 0.0], ", "[[0.5, 0.0, 0.0], ", "segment 'shank': tensor_kg_m2 belongs to no solid"),
        ("[[0.05, 0.0, 0.0], ", "[[-0.05, 0.0, 0.0], ", "segment 'shank': tensor_kg_m2 belongs to no solid"),
        ("[[0.05, 0.0, 0.0], ", "[", "segment 'shank': inertia.tensor_kg_m2"),
        (
            'name = "ankle"\nsegment = "shank"',
            'name = "ankle"\nsegment = "foot"',
            "landmark 'ankle': no segment 'foot'",
        ),
        ('name = "ankle"', 'name = "knee"', "two landmarks of body 'leg' share a name"),
        ("position_m = [0.0, 0.0, -0.4]", "position_m = [0.0, inf, -0.4]", "position_m"),
    ],
)
def test_faulty_limit_slab_inertia_or_landmark_is_refused_in_one_line(tmp_path, old, new, expected):
    assert old in FULL
    message = complaint(tmp_path, FULL.replace(old, new, 1))
    assert message.startswith("body.toml: ")
    assert expected in message


def same(a, b):
    """Every number of two bodies, to rounding; of meshes the triangles, in any order."""
    assert a.name == b.name
    np.testing.assert_array_equal(a.parents, b.parents)
    assert [(mark.name, mark.segment) for mark in a.landmarks] == [(mark.name, mark.segment) for mark in b.landmarks]
    pairs = [(m.position_m, n.position_m) for m, n in zip(a.landmarks, b.landmarks, strict=True)]
    for s, u in zip(a.segments, b.segments, strict=True):
        assert (s.name, s.inertia is None) == (u.name, u.inertia is None)
        pairs += [(s.joint_m, u.joint_m), (s.limits.half_rad, u.limits.half_rad), (s.limits.centre, u.limits.centre)]
        if s.inertia is not None:
            pairs += [(getattr(s.inertia, k), getattr(u.inertia, k)) for k in ("mass_kg", "centre_m", "tensor_kg_m2")]
        for p, q in zip(s.parts, u.parts, strict=True):
            assert (p.name, type(p.shape), p.colour is None) == (q.name, type(q.shape), q.colour is None)
            pairs += [(p.slab_m, q.slab_m), (p.segment_from_part.as_matrix(), q.segment_from_part.as_matrix())]
            pairs += [] if p.colour is None else [(p.colour, q.colour)]
            if isinstance(p.shape, Mesh):
                pairs.append(tuple(triangles(part.shape) for part in (p, q)))
            else:
                pairs.append(tuple(getattr(x.shape, "size_m", None) for x in (p, q)))
                pairs.append(tuple(getattr(x.shape, "semi_axes_m", None) for x in (p, q)))
    for x, y in pairs:
        if x is not None:
            np.testing.assert_allclose(x, y, atol=EXACT)


def triangles(mesh):
    corners = mesh.vertices_m[mesh.faces]
    first = np.lexsort(corners.transpose(2, 0, 1)[::-1], axis=1)[:, 0]
    turned = np.stack([np.roll(c, -k, axis=0) for c, k in zip(corners, first, strict=True)])
    return turned[np.lexsort(turned.reshape(len(turned), -1).T)]


def random_body(seed):
    rng = np.random.default_rng(seed)
    lump = trimesh.creation.icosphere(subdivisions=1, radius=0.1)
    mesh = Mesh(np.asarray(lump.vertices, float) * rng.uniform(0.5, 2, 3), np.asarray(lump.faces, np.int64))
    shapes = [Box(rng.uniform(0.1, 1, 3)), Ellipsoid(rng.uniform(0.1, 1, 3)), mesh, Ellipsoid(rng.uniform(0.3, 1, 3))]
    turns = [Rotation.random(rng=rng), Rotation.identity(), Rotation.random(rng=rng)]
    turns.append(Rotation.from_euler("XYZ", [rng.uniform(-180, 180), rng.choice([-90, 90]), 20], degrees=True))
    parts = tuple(
        Part(
            f'a "{i}" é',
            shape,
            RigidTransform.from_components(rng.normal(size=3), turn),
            None if i == 1 else rng.uniform(0, 255, 3).round(),
            (-np.inf, float(rng.normal() / 9)) if i == 3 else (-np.inf, np.inf),
        )
        for i, (shape, turn) in enumerate(zip(shapes, turns, strict=True))
    )
    limits = np.sort(rng.uniform(-3, 3, (3, 2)), axis=1)
    inertia = Inertia(float(rng.uniform(1, 9)), rng.normal(size=3), np.diag(rng.uniform(0.6, 1, 3)))
    segments = (
        Segment("root", None, np.zeros(3), parts[:2], inertia=inertia),
        Segment("limb", "root", rng.normal(size=3), (), JointLimits.from_angles(limits)),
        Segment("tip", "limb", rng.normal(size=3), parts[2:]),
    )
    landmarks = (Landmark("end", "tip", rng.normal(size=3)), Landmark("root", "limb", np.zeros(3)))
    return BodyModel("bödy", segments, landmarks if seed % 2 else ())


@pytest.mark.parametrize("seed", range(6))
def test_any_body_is_read_back_as_it_was_written(tmp_path, seed):
    model = random_body(seed)
    write_body(tmp_path / "body.toml", model)
    same(read_body(tmp_path / "body.toml"), model)
    (mesh,) = find_mesh_files(tmp_path / "body.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["body.toml", mesh])


@pytest.mark.parametrize("person", [human18(), human18(1.62, 55.0, outfit=SAMPLED)])
def test_a_person_is_read_back_as_written(tmp_path, person):
    write_body(tmp_path / "body.toml", person)
    again = read_body(tmp_path / "body.toml")
    same(again, person)
    assert body_toml(again) == body_toml(person), "writing what was read changes nothing"
    assert "landmark" in body_toml(person)


def test_plain_turns_are_written_in_plain_degrees_and_nothing_needless(tmp_path):
    text = body_toml(read(tmp_path, GOOD))
    assert "rotation_deg = [10.0, 20.0, 30.0]" in text
    for needless in ("rotation_deg = [0", "slab_m", "limits_deg", "inertia", "landmark", "-0.0,"):
        assert needless not in text


@pytest.mark.parametrize("text", ["[[segment]]\nname = 3\n", "segment", "name = 'a'\n"])
def test_the_meshes_of_a_damaged_file_are_refused_in_one_line(tmp_path, text):
    (tmp_path / "body.toml").write_text(text)
    with pytest.raises(BodyError, match=r"^body\.toml") as error:
        find_mesh_files(tmp_path / "body.toml")
    assert "\n" not in str(error.value)
