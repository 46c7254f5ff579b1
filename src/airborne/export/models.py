"""Bodies as 3D model files: binary and plain glTF, OBJ with its material file, PLY with colours at the vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation
from trimesh.exchange.gltf import export_glb, export_gltf
from trimesh.exchange.ply import export_ply
from trimesh.visual import ColorVisuals, TextureVisuals
from trimesh.visual.material import PBRMaterial

from airborne.body import BodyModel, Box, Ellipsoid, Mesh, Part, Pose, PosedBody
from airborne.body.splitting import between, split_at
from airborne.errors import ResultError
from airborne.rendering.srgb import light_from_srgb

Array = NDArray[np.floating]

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
_AROUND, _ALONG = 48, 32  # facets of an ellipsoid
_UNSAMPLED = np.full(3, 128.0)  # sRGB, stands in for a colour not yet sampled
_Y_UP = Rotation.from_euler("x", -90, degrees=True).as_matrix()  # glTF from world: z up becomes y up
_MATT = 0.9  # roughness of a material


def write_model(path: Path, body: PosedBody | BodyModel) -> None:
    """Write a body in its colours, posed, or as a model in its zero pose: .glb, .gltf, .obj or .ply; lengths in metres.

    glTF has y up, as its standard demands, one node a segment, placed from its parent, and the parts in it; its colours
    are linear. OBJ (with an .mtl beside it) and PLY have the world's z up and sRGB. Ellipsoids become facets; a part
    whose colour is still to be sampled is grey. Raises ResultError for another suffix, or where nothing can be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ResultError(f"{path.name}: no known kind of model file; end its name in {', '.join(SUFFIXES)}")
    posed = body.with_pose(Pose(world_from_root=RigidTransform.identity())) if isinstance(body, BodyModel) else body
    write = {".glb": _gltf_files, ".gltf": _gltf_files, ".obj": _obj_files, ".ply": _ply_files}[path.suffix.lower()]
    try:
        for name, data in write(posed, path).items():
            (path.parent / name).write_bytes(data)
    except OSError as error:
        raise ResultError(f"{path.name}: cannot be written ({error.strerror})") from error


def part_mesh(part: Part) -> Mesh:
    """Tessellate a part, cut to its slab, in the part's own frame; smooth shapes come with normals."""
    if isinstance(part.shape, Mesh):
        return part.shape
    if isinstance(part.shape, Box):
        box = trimesh.creation.box(extents=part.shape.size_m)
        return Mesh(np.asarray(box.vertices), np.asarray(box.faces))
    mesh = _ellipsoid_mesh(part.shape)
    for border in part.slab_m:
        if np.isfinite(border):
            mesh = split_at(mesh, mesh.vertices_m[:, 2] - border)
    return between(mesh, mesh.vertices_m[:, 2], *part.slab_m)


def _ellipsoid_mesh(shape: Ellipsoid) -> Mesh:
    ball = trimesh.creation.uv_sphere(count=(_ALONG, _AROUND))
    unit, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    normals = unit / shape.semi_axes_m
    return Mesh(unit * shape.semi_axes_m, faces, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _in_segment(part: Part) -> trimesh.Trimesh:
    """Return a part's mesh in its segment's frame; each face of a flat one has its own corners, so that edges show."""
    mesh, place = part_mesh(part), part.segment_from_part
    if mesh.normals is None:
        vertices, faces = mesh.vertices_m[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size).reshape(-1, 3)
        return trimesh.Trimesh(place.apply(vertices), faces, process=False)
    normals = place.rotation.apply(mesh.normals)
    return trimesh.Trimesh(place.apply(mesh.vertices_m), mesh.faces, vertex_normals=normals, process=False)


def _colour(part: Part) -> Array:
    return _UNSAMPLED if part.colour is None else part.colour


def _gltf_files(posed: PosedBody, path: Path) -> dict[str, bytes]:
    scene, model = trimesh.Scene(base_frame="world"), posed.model
    colours: dict[str, list[float]] = {}
    index = 0
    for segment, R, t, parent in zip(model.segments, posed.R, posed.t, model.parents, strict=True):
        placed = _matrix(R, t)
        above = np.linalg.inv(_matrix(posed.R[parent], posed.t[parent])) if parent >= 0 else _matrix(_Y_UP, np.zeros(3))
        scene.graph.update(
            frame_to=segment.name, frame_from=segment.parent or scene.graph.base_frame, matrix=above @ placed
        )
        for part in segment.parts:
            mesh = _in_segment(part)
            material = f"{index} {part.name}"
            mesh.visual = TextureVisuals(material=PBRMaterial(name=material, metallicFactor=0.0, roughnessFactor=_MATT))
            colours[material] = [*light_from_srgb(_colour(part)).tolist(), 1.0]
            scene.add_geometry(mesh, node_name=material, geom_name=material, parent_node_name=segment.name)
            index += 1

    def paint(tree: dict) -> None:
        for material in tree["materials"]:
            material["pbrMetallicRoughness"]["baseColorFactor"] = colours[material["name"]]

    if path.suffix.lower() == ".glb":
        data = export_glb(scene, include_normals=True, tree_postprocessor=paint)
        return {path.name: data}
    files = export_gltf(scene, include_normals=True, tree_postprocessor=paint, embed_buffers=True)
    return {path.name: files["model.gltf"]}


def _obj_files(posed: PosedBody, path: Path) -> dict[str, bytes]:
    lines, materials, first = [f"mtllib {path.stem}.mtl"], [], 1
    for index, (part, mesh) in enumerate(_in_world(posed)):
        name = "_".join(f"{index} {part.name}".split())
        red, green, blue = _colour(part) / 255
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
    for part, mesh in _in_world(posed):
        colours = np.tile([*np.rint(np.clip(_colour(part), 0, 255)), 255], (len(mesh.vertices), 1)).astype(np.uint8)
        mesh.visual = ColorVisuals(mesh, vertex_colors=colours)
        meshes.append(mesh)
    whole = trimesh.util.concatenate(meshes)
    return {path.name: export_ply(whole, vertex_normal=True)}


def _in_world(posed: PosedBody) -> list[tuple[Part, trimesh.Trimesh]]:
    found = []
    for segment, R, t in zip(posed.model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            found.append((part, _in_segment(part).apply_transform(_matrix(R, t))))
    return found


def _matrix(R: Array, t: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, t
    return matrix
