"""Bodies, poses, cameras and pictures that several tests draw."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import (
    BodyModel,
    Box,
    Ellipsoid,
    Inertia,
    Mesh,
    Part,
    Pose,
    PosedBody,
    Segment,
    SurfaceArrays,
    surface_arrays,
)
from airborne.body.inertia import combine_inertias, transform_inertia
from airborne.body.measurements import STATURE_SHARES, Measurements
from airborne.cameras import Camera
from airborne.geometry.rotations import matrix_from_angles
from airborne.rendering import Lamp, Lights
from airborne.video import View

LIGHTS = Lights(
    0.3,
    (
        Lamp(np.array([1.5, -2.0, 2.0]), 0.5),
        Lamp(np.array([-2.0, -1.0, 1.0]), 0.4, np.array([2.0, 1.0, -1.0]), np.radians(12)),
    ),
)


def camera(name: str = "front", *, turn: float = 0.0, size: tuple[int, int] = (90, 70), skew: float = 0.0) -> Camera:
    """A camera 4 m from the origin, `turn` round the vertical, that looks at it; about 25 px a metre."""
    centre = np.array([4 * np.sin(turn), -4 * np.cos(turn), 0.3])
    z = -centre / np.linalg.norm(centre)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    rotation = Rotation.from_matrix(np.stack([x, np.cross(z, x), z]))
    K = np.array([[100, skew, (size[0] - 1) / 2], [0, 105.0, (size[1] - 1) / 2], [0, 0, 1.0]])
    return Camera(
        name=name, K=K, size=size, camera_from_world=RigidTransform.from_components(-rotation.apply(centre), rotation)
    )


def part(shape, name: str, rng: np.random.Generator, *, spread: float = 0.25) -> Part:
    place = RigidTransform.from_components(rng.normal(0, spread, 3), Rotation.random(rng=rng))
    return Part(name, shape, place, rng.uniform(30, 220, 3))


def random_shape(kind: str, rng: np.random.Generator):
    if kind in ("ellipsoid", "slab"):
        return Ellipsoid(rng.uniform(0.1, 0.5, 3))
    if kind == "box":
        return Box(rng.uniform(0.15, 0.8, 3))
    tip = np.array([[0, 0, 0.5], [0.4, 0, -0.2], [-0.2, 0.35, -0.2], [-0.2, -0.35, -0.2]])
    outward = tip / np.linalg.norm(tip, axis=1, keepdims=True) if kind == "smooth" else None
    return Mesh(tip * rng.uniform(0.5, 1.5), np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]), outward)


def cut(whole: Part, rng: np.random.Generator) -> Part:
    low, high = np.sort(rng.uniform(-1.2, 1.2, 2)) * whole.shape.semi_axes_m[2]
    return replace(whole, slab_m=(min(low, 0.0), max(high, 0.05)))


def in_slabs(whole: Part, heights: list[float]) -> tuple[Part, ...]:
    """The same ellipsoid cut at heights along its own z axis into parts of other colours, from below to above."""
    bounds = [-np.inf, *heights, np.inf]
    colours = np.random.default_rng(len(heights)).uniform(30, 220, (len(bounds) - 1, 3))
    return tuple(
        replace(whole, slab_m=(low, high), colour=colour)
        for low, high, colour in zip(bounds, bounds[1:], colours, strict=False)
    )


def random_body(kinds: list[str], rng: np.random.Generator) -> BodyModel:
    """Two segments that share the parts; the second hangs on the first. A slab is an ellipsoid cut at both ends."""
    parts = [part(random_shape(kind, rng), f"{kind}{i}", rng) for i, kind in enumerate(kinds)]
    parts = [cut(each, rng) if kind == "slab" else each for each, kind in zip(parts, kinds, strict=True)]
    half = (len(parts) + 1) // 2
    return BodyModel(
        "random",
        (
            Segment("root", None, np.zeros(3), tuple(parts[:half])),
            Segment("limb", "root", np.array([0.1, 0.0, 0.2]), tuple(parts[half:])),
        ),
    )


def random_pose(rng: np.random.Generator, *, spread: float = 0.15) -> Pose:
    root = RigidTransform.from_components(rng.normal(0, spread, 3), Rotation.random(rng=rng))
    return Pose(world_from_root=root, joint_angles=rng.normal(0, 0.6, (1, 3)))


def posed_random(kinds: list[str], seed: int) -> tuple[SurfaceArrays, PosedBody]:
    rng = np.random.default_rng(seed)
    model = random_body(kinds, rng)
    return surface_arrays(model), model.with_pose(random_pose(rng))


def noise_view(seen_by: Camera, seed: int) -> View:
    rng = np.random.default_rng(seed)
    return View(seen_by, rng.integers(0, 256, (seen_by.size[1], seen_by.size[0], 3), dtype=np.uint8))


def batch(model: BodyModel, n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """R (n, s, 3, 3) and t (n, s, 3) of n random poses."""
    rng = np.random.default_rng(seed)
    bodies = [model.with_pose(random_pose(rng)) for _ in range(n)]
    return np.stack([body.R for body in bodies]), np.stack([body.t for body in bodies])


def total_inertia(posed: PosedBody) -> Inertia:
    """A posed body's mass, centre of mass [m] and inertia tensor about it [kg m^2], in world axes."""
    segments = zip(posed.model.segments, posed.R, posed.t, strict=True)
    return combine_inertias([transform_inertia(segment.inertia, R, t) for segment, R, t in segments])


def is_within_limits(model: BodyModel, pose: Pose, slack_rad: float = 1e-9) -> bool:
    """Whether no joint of a pose lies beyond its limits by more than a slack."""
    excess = model.limits.excess(matrix_from_angles(pose.joint_angles))
    return bool(np.all(np.abs(excess) <= slack_rad))


def write_measurements(path: Path, measurements: Measurements) -> None:
    """Write a Yeadon measurement file, in metres, to the last digit."""
    lines = ["measurementconversionfactor: 1"]
    lines += [] if measurements.mass_kg is None else [f"totalmass: {float(measurements.mass_kg)!r}"]
    lines += [f"{key}: {float(measurements.values_m[key])!r}" for key in STATURE_SHARES]
    path.write_text("\n".join(lines) + "\n")
