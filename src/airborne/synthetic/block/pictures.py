"""Images of a block scene: the hall is rendered once, then of each frame only the regions near a player."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import PosedBody, SurfaceArrays, surface_arrays
from airborne.cameras import Camera
from airborne.export.pictures import encode_jpeg
from airborne.rendering import Lamp, Lights, render
from airborne.rendering.shapes import new_shapes
from airborne.synthetic.block.court import Layer, draw_clutter, hall_image, net_layer
from airborne.synthetic.block.layers import blend_layer, cast_shadows, composite, expose
from airborne.synthetic.block.players import Player
from airborne.synthetic.block.scene import BlockScene
from airborne.types import Array, Array32, Image
from airborne.video import Frames, View

_Rectangle = tuple[int, int, int, int]  # x0, y0, x1, y1 [px]
Boxes = NDArray[np.int64]  # (..., 4) of them

_HALL_LIGHTS = Lights(0.50, (Lamp(np.array([-5.0, -9.0, 10.0]), 0.36), Lamp(np.array([6.0, -4.0, 10.0]), 0.34)))
_SHADOW_TINT = np.array([0.85, 1.0, 1.02])  # share of each colour's light that is missing: what is left is like skin
_LEAN = np.array([0.12, 0.10])  # a shadow's shift over the floor for each metre of height
_CASTERS = (  # of shadows: landmark, its height over the floor as one stands, radius [m], share of the depth
    ("foot_left", 0.02, 0.20, 1.0),
    ("foot_right", 0.02, 0.20, 1.0),
    ("pelvis", 0.60, 0.50, 0.8),
)
_SQUARE = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
_BODY_MARGIN_M = 0.13  # a body reaches no further than this from its landmarks
_BLOCK_PX = 16  # of JPEG: patches begin and end at its blocks
_N_BACKGROUNDS = 4  # recordings of the static hall, chosen at random by frame
_POOL_MARGIN_PX = 256  # by which the noise is larger than an image: from frame to frame it is shifted


class Drawable(NamedTuple):
    """A player over all n frames, ready to be rendered."""

    player: Player
    surface: SurfaceArrays
    shapes: Any  # workspace of the renderer
    R: Array  # (n, s, 3, 3) world from segment
    t: Array  # (n, s, 3) [m]
    landmarks: Array  # (n, k, 3) [m]
    shadows: Array  # (n, 3, 4) shadows: x, y, radius [m], depth


class ImageBounds(NamedTuple):
    """The bounds of a player in one camera's images, over all n frames; boxes are x0, y0, x1, y1 [px]."""

    depth_m: Array  # (n,)
    body: Boxes  # (n, 4)
    shadows: Boxes  # (n, 3, 4)
    patch: Boxes  # (n, 4) body and shadows, in whole blocks


@dataclass(frozen=True, slots=True, eq=False)
class CameraSetup:
    """One camera, its images of the static hall, and the bounds of the players in its images."""

    camera: Camera  # the true one
    calibrated: Camera  # as calibrated
    background: Image  # (h, w, 3) without the net
    net: Layer
    gain: Array  # (3,)
    recorded_backgrounds: list[Image]  # the hall with the net, as recorded
    floor_from_px: Array  # (3, 3)
    bounds: list[ImageBounds]  # of the drawables


def block_frames(scene: BlockScene, indices: Iterable[int] | None = None) -> Iterator[Frames]:
    """Record a scene frame by frame, or these frames of it, in memory; the views' cameras are the calibrated ones.

    The same scene gives the same pixels.
    """
    rng = np.random.default_rng([scene.seed, 22])
    objects, pool = draw_clutter(rng), _noise_pool(rng, scene)
    drawables = [_drawable(player, scene) for player in scene.players]
    setups = [
        _camera_setup(rng, scene, camera.name, objects=objects, pool=pool, drawables=drawables)
        for camera in scene.calibrated_rig
    ]
    for index in range(scene.n_frames) if indices is None else indices:
        rng = np.random.default_rng([scene.seed, 23, index])
        images = [
            _draw_image(rng, setup, drawables, pool, index=index, quality=scene.difficulty.jpeg_quality)
            for setup in setups
        ]
        views = tuple(View(setup.calibrated, rgb) for setup, rgb in zip(setups, images, strict=True))
        yield Frames(index, Fraction(index) / scene.rate, views)


def _draw_image(
    rng: np.random.Generator,
    setup: CameraSetup,
    drawables: list[Drawable],
    pool: NDArray[np.int8],
    *,
    index: int,
    quality: int,
) -> Image:
    """Render one camera's image of a frame (h, w, 3), as recorded and compressed."""
    recorded = setup.recorded_backgrounds[int(rng.integers(len(setup.recorded_backgrounds)))].copy()
    by_depth = sorted(zip(drawables, setup.bounds, strict=True), key=lambda each: -each[1].depth_m[index])
    for box in _merge([bounds.patch[index] for _, bounds in by_depth]):
        x0, y0, x1, y1 = box
        patch = setup.background[y0:y1, x0:x1].astype(np.float32)
        inside = [each for each in by_depth if _overlap(tuple(each[1].patch[index]), box)]
        for drawable, bounds in inside:
            shadows, boxes = drawable.shadows[index], bounds.shadows[index]
            cast_shadows(patch, x0, y0, setup.floor_from_px, shadows, boxes, _SHADOW_TINT)
        for drawable, bounds in (each for each in inside if each[0].player.side > 0):
            _composite_body(patch, box, setup.camera, drawable, bounds=bounds, index=index)
        blend_layer(patch, setup.net.colour[y0:y1, x0:x1], setup.net.alpha[y0:y1, x0:x1])
        for drawable, bounds in (each for each in inside if each[0].player.side < 0):
            _composite_body(patch, box, setup.camera, drawable, bounds=bounds, index=index)
        recorded[y0:y1, x0:x1] = _record(rng, patch, setup.gain, pool, quality=quality)
    return recorded


def _camera_setup(
    rng: np.random.Generator,
    scene: BlockScene,
    name: str,
    *,
    objects: list,
    pool: NDArray[np.int8],
    drawables: list[Drawable],
) -> CameraSetup:
    camera, spread = scene.rig[name], scene.difficulty.gain_spread
    gain = rng.uniform(1 - spread, 1 + spread) * (1 + 0.5 * spread * rng.uniform(-1, 1, 3) * [1, 0, 1])
    background, net = hall_image(rng, camera, objects), net_layer(camera)
    with_net = background.astype(np.float32)
    blend_layer(with_net, net.colour, net.alpha)
    return CameraSetup(
        camera=camera,
        calibrated=scene.calibrated_rig[name],
        background=background,
        net=net,
        gain=gain,
        recorded_backgrounds=[
            _record(rng, with_net, gain, pool, quality=scene.difficulty.jpeg_quality) for _ in range(_N_BACKGROUNDS)
        ],
        floor_from_px=np.asarray(np.linalg.inv(camera.P[:, [0, 1, 3]]), float),
        bounds=[_image_bounds(camera, drawable) for drawable in drawables],
    )


def _noise_pool(rng: np.random.Generator, scene: BlockScene) -> NDArray[np.int8]:
    """Draw noise (h, w, 3) larger than an image, nine tenths of its variance common to all three colours."""
    width, height = np.array([camera.size for camera in scene.rig]).max(axis=0) + _POOL_MARGIN_PX
    shared = rng.standard_normal((height, width, 1), np.float32) * 0.9**0.5
    own = rng.standard_normal((height, width, 3), np.float32) * 0.1**0.5
    return np.clip(np.round(scene.difficulty.noise_sd * (shared + own)), -127, 127).astype(np.int8)


def _drawable(player: Player, scene: BlockScene) -> Drawable:
    person, poses = player.movement.person, player.poses(scene.times_s)
    R, t = person.pose_segments(poses)
    surface, marks = surface_arrays(player.body), person.landmarks(poses)
    shadows = []
    for name, bottom_m, radius_m, share in _CASTERS:
        rise = np.clip(marks[name][:, 2] - bottom_m, 0, None)
        middle = marks[name][:, :2] + _LEAN * marks[name][:, 2:]
        depth = scene.difficulty.shadow * share / (1 + 1.5 * rise)
        shadows.append(np.column_stack([middle, radius_m * (1 + 0.5 * rise), depth]))
    return Drawable(
        player, surface, new_shapes(surface), R, t, np.stack(list(marks.values()), axis=1), np.stack(shadows, axis=1)
    )


def _image_bounds(camera: Camera, each: Drawable) -> ImageBounds:
    """Find the bounds of a player and his shadows in all of a camera's images."""
    depth = camera.camera_from_world.apply(each.t[:, 0])[:, 2]
    margin = (_BODY_MARGIN_M * camera.K[0, 0] / np.maximum(depth - 0.5, 0.5))[:, None]
    body = camera.px_from_world(each.landmarks)
    corners = each.shadows[:, :, None, :2] + each.shadows[:, :, None, 2:3] * _SQUARE
    shadow = camera.px_from_world(np.concatenate([corners, np.zeros_like(corners[..., :1])], axis=-1))
    body_box = _boxes(camera, body.min(axis=1) - margin, body.max(axis=1) + margin)
    shadow_box = _boxes(camera, shadow.min(axis=2), shadow.max(axis=2))
    all_boxes = np.concatenate([body_box[:, None], shadow_box], axis=1)
    low, high = all_boxes[..., :2].min(axis=1), all_boxes[..., 2:].max(axis=1)
    return ImageBounds(depth, body_box, shadow_box, _boxes(camera, low, high, step=_BLOCK_PX))


def _boxes(camera: Camera, low: Array, high: Array, step: int = 1) -> Boxes:
    """Round corners (..., 2) [px] outward to multiples of a step, and clip them to the image: (..., 4)."""
    rounded = np.concatenate([np.floor(low / step), np.ceil(high / step)], axis=-1) * step
    return np.clip(rounded, 0, [*camera.size, *camera.size]).astype(np.int64)


def _overlap(a: _Rectangle, b: _Rectangle) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _merge(boxes: list[NDArray[np.int64]]) -> list[_Rectangle]:
    """Merge overlapping boxes until none overlap; empty ones are left out."""
    merged: list[_Rectangle] = []
    for x0, y0, x1, y1 in (map(int, each) for each in boxes if each[2] > each[0] and each[3] > each[1]):
        box = (x0, y0, x1, y1)
        while overlapping := next((other for other in merged if _overlap(box, other)), None):
            merged.remove(overlapping)
            a, b = box, overlapping
            box = (min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3]))
        merged.append(box)
    return merged


def _composite_body(
    patch: Array32, box: _Rectangle, camera: Camera, each: Drawable, *, bounds: ImageBounds, index: int
) -> None:
    """Composite a body over the patch, with two samples a pixel side by side, as limbs are mostly upright."""
    x0, y0, x1, y1 = (int(c) for c in bounds.body[index])
    if x1 <= x0 or y1 <= y0:
        return
    supersampled = camera.resample(scale=(0.5, 1.0), offset=(x0 - 0.25, y0), size=(2 * (x1 - x0), y1 - y0))
    posed = PosedBody(each.player.body, each.R[index], each.t[index])
    rendering = render(each.surface, posed, supersampled, _HALL_LIGHTS, shapes=each.shapes)
    composite(patch, x0 - box[0], y0 - box[1], rendering.colour, rendering.part)


def _record(rng: np.random.Generator, patch: Array32, gain: Array, pool: NDArray[np.int8], *, quality: int) -> Image:
    """Return a patch (h, w, 3) after sensor noise and compression."""
    height, width, _ = patch.shape
    v, u = (int(rng.integers(size - own + 1)) for size, own in zip(pool.shape[:2], (height, width), strict=True))
    out = np.empty(patch.shape, np.uint8)
    expose(patch, gain, pool[v : v + height, u : u + width], out)
    if not quality:
        return out
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(out, quality), np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None, "what was just encoded"
    return np.asarray(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), np.uint8)
