"""Body files: what is read, and what is refused in one line."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from airborne.body import Box, Ellipsoid, Mesh, geometry
from airborne.body.files import read_body
from airborne.errors import BodyError
from tests.tolerances import EXACT

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


def test_file_says_segments_parts_places_and_colours(tmp_path):
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
    ("old", "new", "said"),
    [
        ('name = "leg"', 'name = "leg"\nheight = 3', "height: unknown key"),
        ('name = "leg"', "", "name: is missing"),
        ("centre_m", "center_m", "segment.0.part.0.center_m: unknown key"),
        ("size_m = [0.1, 0.2, 0.4]", "size_m = [0.1, -0.2, 0.4]", "part 'upper': size_m is [0.1, -0.2, 0.4]"),
        ("size_m = [0.1, 0.2, 0.4]", "size_m = [0.1, 0.2, nan]", "segment.0.part.0.size_m.2: Input should be a finite"),
        ("size_m = [0.1, 0.2, 0.4]", "size_m = [0.1, 0.2]", "segment.0.part.0.size_m"),
        ("size_m = [0.1, 0.2, 0.4]", "", "part 'upper' is a box and needs size_m"),
        ("size_m = [0.1, 0.2, 0.4]", "semi_axes_m = [1, 1, 1]", "part 'upper' is a box and needs size_m"),
        ("semi_axes_m = [0.05, 0.06, 0.2]", 'semi_axes_m = [1, 1, 1]\nfile = "a.obj"', "file does not belong to it"),
        ("semi_axes_m = [0.05, 0.06, 0.2]", "semi_axes_m = [1, 0, 1]", "part 'lower': semi_axes_m is [1.0, 0.0, 1.0]"),
        ('shape = "box"', 'shape = "cone"', "segment.0.part.0.shape"),
        ("colour_srgb = [10, 20, 30]", "", "part 'upper' needs colour_srgb"),
        ('colour = "sample"', 'colour = "sample"\ncolour_srgb = [1, 2, 3]', "part 'lower' needs colour_srgb"),
        ("colour_srgb = [10, 20, 30]", "colour_srgb = [10, 20, 256]", "colour_srgb.2"),
        ("colour_srgb = [10, 20, 30]", "colour_srgb = [10, 20]", "segment.0.part.0.colour_srgb"),
        ('colour = "sample"', 'colour = "guess"', "segment.1.part.0.colour"),
        ('parent = "thigh"', 'parent = "hip"', "parent 'hip' must stand before it; so far: thigh"),
        ('parent = "thigh"', "", "exactly the first segment has no parent"),
        ('name = "shank"', 'name = "thigh"', "two segments are named 'thigh'"),
        ("centre_m = [0.0, 0.01, -0.2]", "centre_m = [0.0, nan, -0.2]", "centre_m"),
        ("rotation_deg = [10.0, 20.0, 30.0]", "rotation_deg = [10.0, inf, 30.0]", "rotation_deg"),
        ("joint_m = [0.0, 0.0, -0.4]", "joint_m = [0.0, 0.0, inf]", "joint_m"),
        ("[[segment]]", "[[segment", "not a TOML file"),
    ],
)
def test_malformed_file_is_refused_in_one_line_that_names_it_and_the_fault(tmp_path, old, new, said):
    assert old in GOOD
    message = complaint(tmp_path, GOOD.replace(old, new, 1))
    assert message.startswith("body.toml: ")
    assert said in message


def test_file_without_segments_is_refused(tmp_path):
    assert "segment" in complaint(tmp_path, 'name = "a"\nsegment = []')
    assert "is missing" in complaint(tmp_path, "")


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


def test_mesh_with_inward_faces_is_turned_outward(tmp_path):
    lump = trimesh.creation.box((0.2, 0.4, 0.6))
    lump.invert()
    lump.export(tmp_path / "lump.obj")
    flat = geometry(read(tmp_path, MESH.replace("FILE", "lump.obj")))
    middles = flat.corners.reshape(-1, 3, 3).mean(axis=1)
    assert np.all(np.einsum("ij,ij->i", flat.normals, middles) > 0)


@pytest.mark.parametrize(
    ("name", "content", "said"),
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
def test_unusable_mesh_file_is_refused_in_one_line(tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert said in complaint(tmp_path, MESH.replace("FILE", name))


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


def test_measures_in_millimetres_are_noticed(tmp_path):
    trimesh.creation.box(extents=[100, 200, 300]).export(tmp_path / "lump.stl")
    assert "is in millimetres" in complaint(tmp_path, MESH.replace("FILE", "lump.stl"))
    with pytest.raises(BodyError, match="is it in millimetres"):
        Box(np.array([60.0, 900.0, 45.0]))
