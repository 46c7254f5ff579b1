"""glTF 2.0: bodies as trees of nodes with coloured meshes, still or moving.

Source: Khronos Group, "glTF 2.0 Specification". y up, metres, seconds, linear colours; one node a segment, posed
relative to its parent; the node `z_up` above them all rotates our z up into y up.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne import __version__
from airborne.body import BodyModel, Part, PosedBody
from airborne.export.part_meshes import part_colour, segment_mesh
from airborne.export.takes import Take
from airborne.rendering.srgb import light_from_srgb
from airborne.types import Array

_FLOAT, _INDEX = 5126, 5125  # accessor.componentType: FLOAT, UNSIGNED_INT (glTF 2.0, section 5.1)
_VERTICES, _FACES = 34962, 34963  # bufferView.target: ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER (glTF 2.0, section 5.11)
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_MATT = 0.9  # roughness of a material
_Y_UP = Rotation.from_euler("x", -90, degrees=True).as_quat().tolist()
# "glTF", "JSON", "BIN" as little-endian numbers (glTF 2.0, section 4.4)
_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942


def gltf_bytes(posed: PosedBody, *, is_binary: bool) -> bytes:
    """Return the bytes of a body in its pose: of a .glb, or of a .gltf with its buffer embedded."""
    document = _Document()
    nodes = document.add_body(posed.model)
    for segment, (node, parent) in enumerate(zip(nodes, posed.model.parents, strict=True)):
        R, t = posed.R[segment], posed.t[segment]
        if parent >= 0:
            R, t = posed.R[parent].T @ R, posed.model.segments[segment].joint_m
        document.nodes[node] |= {"rotation": Rotation.from_matrix(R).as_quat().tolist(), "translation": t.tolist()}
    return document.binary() if is_binary else document.text()


def write_animation(path: Path, takes: Sequence[Take]) -> None:
    """Write `animation_bytes` as a .glb."""
    path.write_bytes(animation_bytes(takes))


def animation_bytes(takes: Sequence[Take]) -> bytes:
    """Return the bodies of takes with the same frames as one animation, a .glb, that begins at 0 s.

    A body is hidden (scaled to nothing) from a frame without a complete pose to the next with one, and left out if it
    never has one.
    """
    document = _Document()
    for take in takes:
        has_pose = take.has_pose
        if not has_pose.any():
            continue
        nodes = document.add_body(take.model, prefix=f"{take.name}:" if take.name else "")
        seconds = take.time_s - take.time_s[0]
        times = document.accessor(seconds[has_pose], bounds=True)
        angles = np.concatenate([take.root_angles[:, None], take.joint_angles], axis=1)[has_pose]
        document.move(nodes[0], "translation", times, take.position[has_pose])
        for k, node in enumerate(nodes):
            document.move(node, "rotation", times, _continuous(Rotation.from_euler("XYZ", angles[:, k]).as_quat()))
            document.nodes[node]["translation"] = take.model.segments[k].joint_m.tolist()
        changes = np.flatnonzero(np.diff(has_pose, prepend=~has_pose[0]))
        if not has_pose.all():
            scales = np.repeat(has_pose[changes, None].astype(float), 3, axis=1)
            change_times = document.accessor(seconds[changes], bounds=True)
            document.move(nodes[0], "scale", change_times, scales, interpolation="STEP")
    return document.binary()


class _Document:
    """A glTF document under construction."""

    def __init__(self) -> None:
        self.nodes: list[dict[str, Any]] = [{"name": "z_up", "rotation": _Y_UP, "children": []}]
        self._meshes: list[dict] = []
        self._materials: list[dict] = []
        self._accessors: list[dict] = []
        self._views: list[dict] = []
        self._samplers: list[dict] = []
        self._channels: list[dict] = []
        self._data = bytearray()

    def add_body(self, model: BodyModel, prefix: str = "") -> list[int]:
        """Add a node for every segment, with its parts; return their indices."""
        added: list[int] = []
        for segment, parent in zip(model.segments, model.parents, strict=True):
            node = self._add_node(added[parent] if parent >= 0 else 0, {"name": prefix + segment.name})
            for part in segment.parts:
                name = f"{len(self._meshes)} {part.name}"
                self._add_node(node, {"name": name, "mesh": self._add_mesh(part, name)})
            added.append(node)
        return added

    def accessor(self, values: NDArray, *, target: int | None = None, bounds: bool = False) -> int:
        """Put an array (n,) or (n, k) of floats or indices into the buffer."""
        is_index = np.issubdtype(values.dtype, np.integer)
        values = np.ascontiguousarray(values, "<u4" if is_index else "<f4")
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": values.nbytes}
        self._views.append(view | ({} if target is None else {"target": target}))
        self._data += values.tobytes()
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _INDEX if is_index else _FLOAT,
            "count": len(values),
            "type": _KINDS[values[0].size],
        }
        if bounds:
            columns = values.reshape(len(values), -1)
            accessor |= {"min": columns.min(axis=0).tolist(), "max": columns.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def move(self, node: int, what: str, times: int, values: Array, *, interpolation: str = "LINEAR") -> None:
        """Animate a node's translation, rotation or scale."""
        self._samplers.append({"input": times, "interpolation": interpolation, "output": self.accessor(values)})
        self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": what}})

    def binary(self) -> bytes:
        """Return the asset as a .glb."""
        text = json.dumps(self._tree({}), separators=(",", ":")).encode()
        chunks = b""
        for kind, chunk, filler in ((_JSON, text, b" "), (_BIN, bytes(self._data), b"\0")):
            chunk += filler * (-len(chunk) % 4)
            chunks += struct.pack("<II", len(chunk), kind) + chunk
        return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks

    def text(self) -> bytes:
        """Return the asset as a .gltf whose buffer is within."""
        data = base64.b64encode(self._data).decode()
        return json.dumps(self._tree({"uri": f"data:application/octet-stream;base64,{data}"})).encode()

    def _tree(self, buffer: dict[str, str]) -> dict[str, Any]:
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"Airborne {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{key: value for key, value in node.items() if value != []} for node in self.nodes],
            "meshes": self._meshes,
            "materials": self._materials,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._data), **buffer}],
        }
        if self._channels:
            tree["animations"] = [{"name": "motion", "channels": self._channels, "samplers": self._samplers}]
        return tree

    def _add_node(self, parent: int, node: dict[str, Any]) -> int:
        self.nodes.append({**node, "children": []})
        self.nodes[parent]["children"].append(len(self.nodes) - 1)
        return len(self.nodes) - 1

    def _add_mesh(self, part: Part, name: str) -> int:
        mesh = segment_mesh(part)
        normals = np.array(mesh.vertex_normals)
        normals[np.linalg.norm(normals, axis=1) < 0.5] = (0, 0, 1)  # of triangles without area
        attributes = {
            "POSITION": self.accessor(np.asarray(mesh.vertices, float), target=_VERTICES, bounds=True),
            "NORMAL": self.accessor(normals, target=_VERTICES),
        }
        faces = self.accessor(np.asarray(mesh.faces).ravel(), target=_FACES)
        colour = [*light_from_srgb(part_colour(part)).tolist(), 1.0]
        surface = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": _MATT}
        self._materials.append({"name": name, "pbrMetallicRoughness": surface})
        primitive = {"attributes": attributes, "indices": faces, "material": len(self._materials) - 1}
        self._meshes.append({"name": name, "primitives": [primitive]})
        return len(self._meshes) - 1


def _continuous(quaternions: Array) -> Array:
    """Choose the signs of quaternions (n, 4) so that each is nearest to the one before."""
    signs = np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0, -1.0, 1.0)
    return quaternions * np.cumprod(np.concatenate([[1.0], signs]))[:, None]
