"""glTF animations: valid by the specification's rules, and at every key the body stands where it was found."""

import json
import struct

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from airborne.export.gltf import write_animation
from airborne.export.part_meshes import segment_mesh
from airborne.export.takes import player_takes
from tests.support.export_scenes import BOX, PERSON
from tests.support.takes import jumping, take_of, tumbling

WORLD_FROM_GLTF = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
SINGLE = 1e-6  # of 32-bit floats, some joints away
WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Asset:
    """A .glb as the specification says that it is to be read."""

    def __init__(self, path):
        data = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        n_json, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and n_json % 4 == 0
        self.tree = json.loads(data[20 : 20 + n_json])
        n_bin, kind = struct.unpack_from("<I4s", data, 20 + n_json)
        assert kind == b"BIN\0" and n_bin % 4 == 0 and 28 + n_json + n_bin == len(data)
        self.buffer = data[28 + n_json :]
        self.nodes = self.tree["nodes"]
        self.names = [node["name"] for node in self.nodes]

    def read(self, index):
        accessor = self.tree["accessors"][index]
        view, width = self.tree["bufferViews"][accessor["bufferView"]], WIDTH[accessor["type"]]
        start = view["byteOffset"]
        assert start % 4 == 0 and start + view["byteLength"] <= self.tree["buffers"][0]["byteLength"]
        assert accessor["count"] * width * 4 == view["byteLength"]
        values = np.frombuffer(
            self.buffer, {5126: "<f4", 5125: "<u4"}[accessor["componentType"]], accessor["count"] * width, start
        ).reshape(-1, width)
        for bound, edge in (("min", values.min(axis=0)), ("max", values.max(axis=0))):
            assert bound not in accessor or accessor[bound] == edge.tolist()
        return values

    def channels(self):
        """Each animated property: node, path, interpolation, times, values."""
        for animation in self.tree.get("animations", []):
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                assert {"min", "max"} <= self.tree["accessors"][sampler["input"]].keys()
                times = self.read(sampler["input"]).ravel()
                target = channel["target"]
                yield target["node"], target["path"], sampler["interpolation"], times, self.read(sampler["output"])

    def world_from_nodes(self, seconds):
        """World from node, our axes, at a time: linear places and steps; rotations only at keys."""
        local = {k: {p: node.get(p) for p in ("translation", "rotation", "scale")} for k, node in enumerate(self.nodes)}
        for node, path, interpolation, times, values in self.channels():
            key = max(np.searchsorted(times, seconds + 1e-5, "right") - 1, 0)
            if interpolation == "LINEAR" and path == "translation":
                value = [np.interp(seconds, times, values[:, k]) for k in range(3)]
            else:
                value = values[key]
            local[node][path] = value
        placed = {}

        def walk(k, above):
            one, matrix = local[k], np.eye(4)
            turn = np.eye(3) if one["rotation"] is None else Rotation.from_quat(one["rotation"]).as_matrix()
            matrix[:3, :3] = turn * (1.0 if one["scale"] is None else np.asarray(one["scale"]))
            matrix[:3, 3] = 0 if one["translation"] is None else one["translation"]
            placed[k] = above @ matrix
            for child in self.nodes[k].get("children", []):
                walk(child, placed[k])

        turn = np.eye(4)
        turn[:3, :3] = WORLD_FROM_GLTF
        for k in self.tree["scenes"][self.tree["scene"]]["nodes"]:
            walk(k, turn)
        return placed


def write_and_read(tmp_path, *takes):
    write_animation(tmp_path / "run.glb", takes)
    return Asset(tmp_path / "run.glb")


@pytest.mark.parametrize("model", [PERSON, BOX], ids=["person", "box"])
def test_at_every_key_the_body_has_its_estimated_pose(model, tmp_path):
    motion = tumbling(5, model=model, first=30)
    take = take_of(motion, model)
    asset = write_and_read(tmp_path, take)
    for row, seconds in enumerate(take.time_s - take.time_s[0]):
        body, placed = model.with_pose(motion.pose(row)), asset.world_from_nodes(seconds)
        for segment, R, t in zip(model.segments, body.R, body.t, strict=True):
            result = placed[asset.names.index(segment.name)]
            np.testing.assert_allclose(result[:3, :3], R, atol=SINGLE)
            np.testing.assert_allclose(result[:3, 3], t, atol=SINGLE)


def test_parts_hang_on_their_segments_as_they_are(tmp_path):
    asset = write_and_read(tmp_path, take_of(tumbling(2), PERSON))
    shapes = [part for segment in PERSON.segments for part in segment.parts]
    owners = [segment.name for segment in PERSON.segments for _ in segment.parts]
    parents = {child: k for k, node in enumerate(asset.nodes) for child in node.get("children", [])}
    meshes = [k for k, node in enumerate(asset.nodes) if "mesh" in node]
    assert [asset.names[parents[k]] for k in meshes] == owners
    for k, part in zip(meshes, shapes, strict=True):
        (primitive,) = asset.tree["meshes"][asset.nodes[k]["mesh"]]["primitives"]
        np.testing.assert_allclose(
            asset.read(primitive["attributes"]["POSITION"]), segment_mesh(part).vertices, atol=1e-7
        )
        normals = asset.read(primitive["attributes"]["NORMAL"])
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
        assert asset.read(primitive["indices"]).max() < len(normals)
    assert len(parents) == len(asset.nodes) - 1  # a tree with one root


def test_samplers_are_as_the_specification_asks(tmp_path):
    asset = write_and_read(tmp_path, take_of(tumbling(30, turns=4.0, lost=(7, 8)), PERSON))
    observed = set()
    for node, path, interpolation, times, values in asset.channels():
        assert (node, path) not in observed
        observed.add((node, path))
        assert times[0] >= 0 and (np.diff(times) > 0).all()
        assert len(times) == len(values)
        assert interpolation == ("STEP" if path == "scale" else "LINEAR")
        if path == "rotation":
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1, atol=1e-6)
            assert (np.sum(values[1:] * values[:-1], axis=1) > 0).all()  # the short way round
    assert len(observed) == len(PERSON.segments) + 2


def test_a_lost_body_is_not_shown(tmp_path):
    take = take_of(tumbling(9, lost=(0, 4, 5)), PERSON)
    asset = write_and_read(tmp_path, take)
    for row, seconds in enumerate(take.time_s - take.time_s[0]):
        size = np.abs(np.linalg.det(asset.world_from_nodes(seconds)[asset.names.index("head")][:3, :3]))
        assert size == pytest.approx(1.0 if take.has_pose[row] else 0.0, abs=1e-5)


def test_players_share_the_animation_and_its_clock(tmp_path):
    motion = jumping(6, lost=(2,))
    takes = player_takes(motion)
    asset = write_and_read(tmp_path, *takes)
    for row in (0, 1, 3, 5):
        placed = asset.world_from_nodes(row / 60)
        for p, name in enumerate(("Anna", "number_7")):
            for joint, segment in (
                ("hip_left", "thigh_left"),
                ("knee_right", "shank_right"),
                ("ankle_left", "foot_left"),
            ):
                result = placed[asset.names.index(f"{name}:{segment}")][:3, 3]
                np.testing.assert_allclose(result, motion.points[row, p, motion.joints.index(joint)], atol=SINGLE)


def test_trimesh_loads_the_scene(tmp_path):
    write_and_read(tmp_path, take_of(tumbling(3), PERSON))
    scene = trimesh.load_scene(tmp_path / "run.glb")
    assert len(scene.geometry) == len(PERSON.parts)
