"""Model files read back as the body that was written."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Mesh, Part, Pose, Segment, human18
from airborne.body.skin import skin_of
from airborne.errors import ResultError
from airborne.export.models import write_model
from airborne.export.part_meshes import part_mesh
from airborne.rendering.srgb import srgb_from_light
from tests.support.tolerances import ROUNDTRIP, SOLVED

KINDS = ("glb", "gltf", "obj", "ply")
TO_WORLD = {"glb": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), "gltf": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])}
RED, GREEN, BLUE = np.array([200.0, 30.0, 40.0]), np.array([10.0, 160.0, 50.0]), np.array([30.0, 60.0, 220.0])


def small_body():
    tetrahedron = Mesh(
        np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]),
        np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
    )
    ball = Ellipsoid(np.array([0.1, 0.2, 0.3]))
    place = RigidTransform.from_components([0.1, 0.0, 0.2], Rotation.from_euler("XYZ", [0.4, 0.2, -0.3]))
    return BodyModel(
        "small",
        (
            Segment("root", None, np.zeros(3), (Part("block", Box(np.array([0.3, 0.2, 0.1])), place, RED),)),
            Segment("tip", "root", np.array([0.0, 0.1, 0.3]), (Part("tetra", tetrahedron, place, GREEN),)),
            Segment(
                "ball",
                "tip",
                np.array([0.2, 0.0, 0.0]),
                (
                    Part("lower", ball, RigidTransform.identity(), BLUE, (-np.inf, 0.1)),
                    Part("upper", ball, RigidTransform.identity(), None, (0.1, np.inf)),
                ),
            ),
        ),
    )


def pose_model(model, seed=0):
    rng = np.random.default_rng(seed)
    root = RigidTransform.from_components(rng.normal(0, 1, 3), Rotation.random(rng=rng))
    return model.with_pose(Pose(world_from_root=root, joint_angles=rng.normal(0, 0.5, (len(model.segments) - 1, 3))))


def volumes_and_centres(body):
    """Of every part, from its tessellation and the pose."""
    result = []
    for segment, R, t in zip(body.model.segments, body.R, body.t, strict=True):
        for part in segment.parts:
            mesh, place = part_mesh(part), part.segment_from_part
            vertices = place.apply(mesh.vertices_m) @ R.T + t
            result.append(trimesh.Trimesh(vertices, mesh.faces, process=False))
    return result


@pytest.mark.parametrize("kind", KINDS)
def test_every_part_reads_back_where_the_pose_put_it(kind, tmp_path):
    body = pose_model(small_body())
    write_model(tmp_path / f"body.{kind}", body)
    read = trimesh.load_scene(tmp_path / f"body.{kind}", process=False)
    whole = read.to_mesh()
    turn = TO_WORLD.get(kind, np.eye(3))
    written = trimesh.util.concatenate(volumes_and_centres(body))
    np.testing.assert_allclose((whole.vertices @ turn.T).min(axis=0), written.vertices.min(axis=0), atol=1e-6)
    np.testing.assert_allclose((whole.vertices @ turn.T).max(axis=0), written.vertices.max(axis=0), atol=1e-6)
    assert whole.area == pytest.approx(written.area, rel=SOLVED)
    assert whole.volume == pytest.approx(written.volume, rel=SOLVED)
    if kind != "ply":
        assert len(read.geometry) == len(body.model.parts)


@pytest.mark.parametrize("kind", ["glb", "gltf"])
def test_gltf_is_a_skeleton_of_the_segments_in_linear_colours(kind, tmp_path):
    body = pose_model(small_body(), 1)
    write_model(tmp_path / f"body.{kind}", body)
    scene = trimesh.load(tmp_path / f"body.{kind}")
    assert {child: scene.graph.transforms.parents[child] for child in ("root", "tip", "ball")} == {
        "root": "z_up",
        "tip": "root",
        "ball": "tip",
    }
    for segment, t in zip(body.model.segments, body.t, strict=True):
        np.testing.assert_allclose(TO_WORLD[kind] @ scene.graph.get(segment.name)[0][:3, 3], t, atol=1e-6)
    if kind == "gltf":
        tree = json.loads((tmp_path / "body.gltf").read_text())
        factors = [m["pbrMetallicRoughness"]["baseColorFactor"] for m in tree["materials"]]
        expected = {"block": RED, "tetra": GREEN, "lower": BLUE, "upper": np.full(3, 128.0)}
        for material, factor in zip(tree["materials"], factors, strict=True):
            colour = srgb_from_light(np.array(factor[:3]))
            np.testing.assert_allclose(colour, expected[material["name"].split(" ")[1]], atol=0.1)
        assert all("NORMAL" in primitive["attributes"] for mesh in tree["meshes"] for primitive in mesh["primitives"])


def test_obj_and_ply_keep_the_srgb_colours(tmp_path):
    body = small_body()
    write_model(tmp_path / "body.obj", body)
    write_model(tmp_path / "body.ply", body)
    scene = trimesh.load(tmp_path / "body.obj")
    result = {name.split("_")[1]: mesh.visual.material.diffuse[:3] for name, mesh in scene.geometry.items()}
    assert {name: tuple(colour) for name, colour in result.items()} == {
        "block": tuple(RED),
        "tetra": tuple(GREEN),
        "lower": tuple(BLUE),
        "upper": (128, 128, 128),
    }
    whole = trimesh.load(tmp_path / "body.ply", process=False)
    colours = {tuple(colour) for colour in whole.visual.vertex_colors[:, :3].tolist()}
    assert colours == {tuple(RED), tuple(GREEN), tuple(BLUE), (128, 128, 128)}


def test_facets_of_an_ellipsoid_fill_it_and_its_slabs_make_it_whole():
    shape = Ellipsoid(np.array([0.1, 0.2, 0.3]))
    whole = part_mesh(Part("p", shape, RigidTransform.identity(), RED))
    solid = trimesh.Trimesh(whole.vertices_m, whole.faces, process=False)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(4 / 3 * np.pi * 0.1 * 0.2 * 0.3, rel=0.01)
    np.testing.assert_allclose(np.sum((whole.vertices_m / shape.semi_axes_m) ** 2, axis=1), 1, atol=ROUNDTRIP)
    halves = [
        part_mesh(Part("p", shape, RigidTransform.identity(), RED, slab)) for slab in ((-np.inf, 0.11), (0.11, np.inf))
    ]
    assert halves[0].vertices_m[:, 2].max() == pytest.approx(0.11) == halves[1].vertices_m[:, 2].min()
    area = sum(trimesh.Trimesh(half.vertices_m, half.faces, process=False).area for half in halves)
    assert area == pytest.approx(solid.area, rel=ROUNDTRIP)


@pytest.mark.parametrize("kind", KINDS)
def test_a_model_without_a_pose_stands_in_its_zero_pose(kind, tmp_path):
    model = skin_of(human18(1.7, 65.0))
    write_model(tmp_path / f"person.{kind}", model)
    extents = trimesh.load_scene(tmp_path / f"person.{kind}").extents
    assert extents[1 if kind.startswith("gl") else 2] == pytest.approx(1.7, rel=0.01)


def test_other_endings_and_missing_folders_are_refused_in_one_line(tmp_path):
    body = small_body()
    with pytest.raises(ResultError, match=r"person\.fbx.*\.glb, \.gltf, \.obj, \.ply"):
        write_model(tmp_path / "person.fbx", body)
    with pytest.raises(ResultError, match="cannot be written"):
        write_model(tmp_path / "nowhere" / "person.glb", body)


def test_parts_of_one_name_do_not_overwrite_each_other(tmp_path):
    model = small_body()
    twins = tuple(replace(s, parts=tuple(replace(p, name="same") for p in s.parts)) for s in model.segments)
    for kind in ("glb", "obj"):
        write_model(tmp_path / f"twins.{kind}", replace(model, segments=twins))
        assert len(trimesh.load(tmp_path / f"twins.{kind}").geometry) == 4
