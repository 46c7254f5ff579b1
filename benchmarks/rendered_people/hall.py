"""The hall that stands still behind a person: path-traced by Blender (bpy), once for each camera.

A floor with a mat, four walls with windows and wall bars, boxes and posts that leave the person free, people who stand
by, lamps above or light from one side.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import bpy  # pyright: ignore[reportMissingImports]
import numpy as np
from cameras import SIZE, Camera
from mathutils import Matrix, Vector  # pyright: ignore[reportMissingImports]
from people import Colours
from rotations import about_z

SAMPLES = 5  # rays per pixel before denoising; chosen: a minute or two per camera
_FREE_M, _FREE_BY_PEOPLE_M, _FREE_BY_CAMERAS_M = 1.6, 1.8, 1.5  # chosen: beside the lines of sight, around the cameras
_COLOURS = (
    (200, 40, 45), (40, 80, 180), (230, 190, 60), (60, 140, 80), (130, 132, 138), (225, 222, 214), (60, 40, 32),
)  # fmt: skip
_SENSOR_MM = 36  # only its ratio to the focal length counts


class Bystanders(NamedTuple):
    """People who stand still in the background."""

    vertices_m: Sequence[np.ndarray]  # each (v, 3)
    faces: np.ndarray  # (f, 4)
    materials: np.ndarray  # (f,) as of a Body


class _Place(NamedTuple):
    """Where the hall's middle is, and who looks at it."""

    x: float  # [m]
    y: float
    cameras: list[Camera]

    def is_free(self, x: float, y: float, beside_m: float) -> bool:
        """Whether a thing there hides the person from no camera."""
        for camera in self.cameras:
            sight = np.array([self.x, self.y]) - camera.place_m[:2]
            to_thing = np.array([x, y]) - camera.place_m[:2]
            aside_m = abs(sight[0] * to_thing[1] - sight[1] * to_thing[0]) / np.linalg.norm(sight)
            is_before = to_thing @ sight / (sight @ sight) < 1.12
            if (is_before and aside_m < beside_m) or np.linalg.norm(to_thing) < _FREE_BY_CAMERAS_M:
                return False
        return True


def render_hall(
    rng: np.random.Generator,
    folder: Path,
    cameras: list[Camera],
    middle_m: np.ndarray,
    light: str,
    bystanders: Bystanders,
) -> list[Path]:
    """Write the background of each camera (PNG, sRGB) and return the files.

    The hall is built around the flight's middle (3,) [m], by `light` "hall" or "window".
    """
    place = _Place(float(middle_m[0]), float(middle_m[1]), cameras)
    scene = _empty_scene()
    _build_room(place, light == "hall")
    _put_things(rng, place)
    _put_lamps(scene, place, light == "hall")
    _put_bystanders(rng, place, bystanders)
    paths = []
    for number, camera in enumerate(cameras, start=1):
        path = folder / f"background{number}.png"
        scene.camera = _blender_camera(scene, camera)
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        paths.append(path)
    return paths


def _empty_scene() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = True
    scene.cycles.max_bounces = 2
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.render.use_persistent_data = True
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.filter_size = 1.5
    scene.view_settings.view_transform, scene.view_settings.look = "Standard", "None"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "8"
    return scene


def _blender_camera(scene: Any, camera: Camera) -> Any:
    data = bpy.data.cameras.new("camera")
    data.sensor_width, data.lens = _SENSOR_MM, camera.focal_px * _SENSOR_MM / SIZE[0]
    found = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(found)
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = camera.R.T @ np.diag([1, -1, -1])  # Blender's look along -z, y up
    world_from_camera[:3, 3] = camera.place_m
    found.matrix_world = Matrix(world_from_camera.tolist())
    return found


def _paint(colour: Sequence[float], roughness: float = 0.7, spots: float = 0.12, spots_per_m: float = 30.0) -> Any:
    """Return a material of a colour (sRGB, 0 to 255) with spots lighter and darker by a share."""
    material = bpy.data.materials.new("paint")
    material.use_nodes = True
    tree = material.node_tree
    surface = tree.nodes["Principled BSDF"]
    surface.inputs["Roughness"].default_value = roughness
    shares = np.array(colour) / 255
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    if not spots:
        surface.inputs["Base Color"].default_value = (*linear, 1)
        return material
    noise, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = spots_per_m, 0
    dark, bright = ramp.color_ramp.elements
    dark.position, dark.color = 0.35, (*(linear * (1 - spots)), 1)
    bright.position, bright.color = 0.65, (*np.minimum(linear * (1 + spots), 1), 1)
    where = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(where.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs["Fac"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], surface.inputs["Base Color"])
    return material


def _glow(colour: Sequence[float], strength: float) -> Any:
    """Return a material that shines, linear colour, without being sampled as a lamp."""
    material = bpy.data.materials.new("glow")
    material.use_nodes = True
    material.cycles.emission_sampling = "NONE"
    nodes = material.node_tree.nodes
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs[0].default_value, emission.inputs[1].default_value = (*colour, 1), strength
    material.node_tree.links.new(emission.outputs[0], output.inputs[0])
    return material


def _box(centre_m: Sequence[float], size_m: Sequence[float], material: Any, turned_rad: float = 0.0) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1, location=centre_m, rotation=(0, 0, turned_rad))
    bpy.context.object.scale = size_m
    bpy.context.object.data.materials.append(material)


def _build_room(place: _Place, has_lamps: bool) -> None:
    """Build floor, mat, walls, ceiling, windows and wall bars; all sizes and colours chosen."""
    x, y = place.x, place.y
    _box((x, y, -0.05), (24, 24, 0.1), _paint((196, 160, 110) if has_lamps else (90, 130, 110), 0.5, 0.1, 3))
    _box((x, y, 0.005), (6, 12, 0.03), _paint((70, 120, 190) if has_lamps else (150, 60, 50), 0.6, 0.05, 8))
    bright, brown = _paint((200, 196, 188), 0.9, 0.06, 2), _paint((150, 116, 80), 0.9, 0.15, 1.5)
    for side, wall in ((1, bright), (-1, brown)):
        _box((x, y + 11 * side, 3.5), (24, 0.2, 7.2), wall)
        _box((x + 11 * side, y, 3.5), (0.2, 24, 7.2), wall)
    _box((x, y, 7.1), (24, 24, 0.1), _paint((90, 95, 110), 0.9, 0.1, 2))
    window = _glow((0.9, 0.97, 1), 3.0)
    for along in -9 + 3.4 * np.arange(6):
        _box((x + along, y + 10.85, 4.6), (1.7, 0.1, 1.7), window)
        _box((x + 10.85, y + along, 4.6), (0.1, 1.7, 1.7), window)
    wood = _paint((165, 120, 70), 0.5, 0.2, 6)
    for along in -8 + 0.7 * np.arange(24):
        _box((x + along, y - 10.7, 1.3), (0.08, 0.15, 2.6), wood)
    for height in 0.2 + 0.2 * np.arange(12):
        _box((x, y - 10.7, height), (16, 0.05, 0.05), wood)


def _put_things(rng: np.random.Generator, place: _Place) -> None:
    """Put boxes and posts where chance wants them and no camera's sight is lost."""
    for _ in range(26):
        azimuth, away_m = rng.uniform(0, 2 * np.pi), rng.uniform(4.2, 9.5)
        x, y = place.x + away_m * np.cos(azimuth), place.y + away_m * np.sin(azimuth)
        size_m = rng.uniform([0.3, 0.3, 0.2], [2.0, 1.0, 1.3])
        if place.is_free(x, y, _FREE_M):
            colour = _COLOURS[rng.integers(len(_COLOURS))]
            _box((x, y, size_m[2] / 2), size_m, _paint(colour, 0.6, 0.1, 10), rng.uniform(0, 3))
    for _ in range(5):
        azimuth = rng.uniform(0, 2 * np.pi)
        x, y = place.x + 8 * np.cos(azimuth), place.y + 8 * np.sin(azimuth)
        if place.is_free(x, y, _FREE_M):
            _box((x, y, 1.6), (0.12, 0.12, 3.2), _paint(_COLOURS[rng.integers(len(_COLOURS))], 0.4, 0))


def _put_lamps(scene: Any, place: _Place, has_lamps: bool) -> None:
    """Light the hall: two lamps at the ceiling, or a large window and a weak lamp; and a little from everywhere."""
    lamps = [((-3, 1, 6.9), 1300, 3), ((4, -2, 6.9), 1000, 3)]
    if not has_lamps:
        lamps = [((9.5, 2, 5), 2600, 4), ((-3, -3, 6.9), 500, 3)]
    for (x, y, z), power_w, size_m in lamps:
        bpy.ops.object.light_add(type="AREA", location=(place.x + x, place.y + y, z))
        lamp = bpy.context.object
        lamp.data.energy, lamp.data.size = power_w, size_m
        if size_m == 4:
            lamp.rotation_euler = Vector((-1, -0.2, -0.35)).to_track_quat("-Z", "Y").to_euler()
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    everywhere = scene.world.node_tree.nodes["Background"]
    everywhere.inputs[0].default_value, everywhere.inputs[1].default_value = (0.5, 0.55, 0.6, 1), 0.12


def _put_bystanders(rng: np.random.Generator, place: _Place, people: Bystanders) -> None:
    """Put people on the floor, in clothes of chance colours, where no camera's sight is lost."""
    for posed_m in people.vertices_m:
        top, shorts, socks = (_COLOURS[rng.integers(len(_COLOURS))] for _ in range(3))
        colours = Colours(skin=(205, 165, 135), hair=(50, 40, 34), top=top, shorts=shorts, socks=socks)
        azimuth, away_m, turned_rad = rng.uniform(0, 2 * np.pi), rng.uniform(5.5, 8.5), rng.uniform(0, 6)
        at_m = np.array([place.x + away_m * np.cos(azimuth), place.y + away_m * np.sin(azimuth), 0])
        if not place.is_free(at_m[0], at_m[1], _FREE_BY_PEOPLE_M):
            continue
        foot_m = np.array([*posed_m.mean(axis=0)[:2], posed_m[:, 2].min()])
        vertices_m = (posed_m - foot_m) @ about_z(np.degrees(turned_rad)).T + at_m
        _mesh(vertices_m, people.faces, people.materials, colours)


def _mesh(vertices_m: np.ndarray, faces: np.ndarray, materials: np.ndarray, colours: Colours) -> None:
    mesh = bpy.data.meshes.new("person")
    mesh.from_pydata(vertices_m.tolist(), [], faces.tolist())
    for number, colour in enumerate(colours.by_material()):
        mesh.materials.append(_paint(colour, 0.4 if number == 1 else 0.6, 0.08, 40))
    mesh.polygons.foreach_set("material_index", materials.astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("person", mesh))
