"""Bodies as 3D model files: binary and plain glTF, OBJ with its material file, PLY with colours at the vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform
from trimesh.exchange.ply import export_ply
from trimesh.visual import ColorVisuals

from airborne.body import BodyModel, Part, Pose, PosedBody
from airborne.errors import ResultError
from airborne.export.gltf import gltf_bytes
from airborne.export.part_meshes import part_colour, segment_mesh
from airborne.types import Array

_SUFFIXES = (".glb", ".gltf", ".obj", ".ply")


def write_model(path: Path, body: PosedBody | BodyModel) -> None:
    """Write a body in its colours, posed, or as a model in its zero pose: .glb, .gltf, .obj or .ply; lengths in metres.

    glTF has y up, as its standard demands, one node a segment, posed relative to its parent; its colours
    are linear. OBJ (with an .mtl beside it) and PLY have the world's z up and sRGB. Ellipsoids become facets; a part
    whose colour is still to be sampled is grey. Raises ResultError for another suffix, or where nothing can be written.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise ResultError(f"{path.name}: not a known format of model files; end its name in {', '.join(_SUFFIXES)}")
    posed = body.with_pose(Pose(world_from_root=RigidTransform.identity())) if isinstance(body, BodyModel) else body
    write = {".glb": _gltf_files, ".gltf": _gltf_files, ".obj": _obj_files, ".ply": _ply_files}[path.suffix.lower()]
    try:
        for name, data in write(posed, path).items():
            (path.parent / name).write_bytes(data)
    except OSError as error:
        raise ResultError(f"{path.name}: cannot be written ({error.strerror})") from error


def _gltf_files(posed: PosedBody, path: Path) -> dict[str, bytes]:
    return {path.name: gltf_bytes(posed, is_binary=path.suffix.lower() == ".glb")}


def _obj_files(posed: PosedBody, path: Path) -> dict[str, bytes]:
    lines, materials, first = [f"mtllib {path.stem}.mtl"], [], 1
    for index, (part, mesh) in enumerate(_world_meshes(posed)):
        name = "_".join(f"{index} {part.name}".split())
        red, green, blue = part_colour(part) / 255
        materials += [f"newmtl {name}", f"Kd {red:.6f} {green:.6f} {blue:.6f}", "illum 1", ""]
        lines += [f"o {name}", f"usemtl {name}"]
        lines += [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in mesh.vertices]
        lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in mesh.vertex_normals]
        lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in (mesh.faces + first).tolist()]
        first += len(mesh.vertices)
    return {
        path.name: ("\n".join(lines) + "\n").encode(),
        f"{path.stem}.mtl": ("\n".join(materials) + "\n").encode(),
    }


def _ply_files(posed: PosedBody, path: Path) -> dict[str, bytes]:
    meshes = []
    for part, mesh in _world_meshes(posed):
        colours = np.tile([*np.rint(np.clip(part_colour(part), 0, 255)), 255], (len(mesh.vertices), 1)).astype(np.uint8)
        mesh.visual = ColorVisuals(mesh, vertex_colors=colours)
        meshes.append(mesh)
    whole = trimesh.util.concatenate(meshes)
    return {path.name: export_ply(whole, vertex_normal=True)}


def _world_meshes(posed: PosedBody) -> list[tuple[Part, trimesh.Trimesh]]:
    meshes = []
    for segment, R, t in zip(posed.model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            meshes.append((part, segment_mesh(part).apply_transform(_matrix(R, t))))
    return meshes


def _matrix(R: Array, t: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, t
    return matrix
