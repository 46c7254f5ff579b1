"""Small clips with truth: a coloured body thrown over a cluttered background, seen by up to four cameras."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Part, Pose, Segment, surface_arrays
from airborne.body.limits import JointLimits
from airborne.cameras import Camera
from airborne.rendering import Lamp, Lights, render
from airborne.rendering.srgb import light_from_srgb
from airborne.tracking import Estimate, Status
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import Tracker, step
from airborne.video import Frames, View

SIZE = (320, 240)
FPS = 50
FINER, REACH = 3, 0.16  # drawn pixels a pixel; half the side of the square that holds the body, in focal lengths
LIGHTS = Lights(0.6, (Lamp(np.array([3.0, -4.0, 5.0]), 0.4),))
_light = np.linspace(0, 1, 1 << 14)
_srgb = np.where(_light <= 0.0031308, 12.92 * _light, 1.055 * _light ** (1 / 2.4) - 0.055)
SRGB = (255 * _srgb).astype(np.float32)
GRAVITY = np.array([0, 0, -9.81])
YELLOW, BLUE, RED = (220.0, 190.0, 40.0), (40.0, 60.0, 190.0), (200.0, 40.0, 40.0)


def part(name: str, shape, centre, colour) -> Part:
    place = RigidTransform.from_components(np.array(centre, float), Rotation.identity())
    return Part(name, shape, place, np.array(colour))


def rigid_body(*parts: Part) -> BodyModel:
    return BodyModel("body", (Segment("root", None, np.zeros(3), parts),))


CROSS = rigid_body(
    part("long", Box(np.array([0.08, 0.8, 0.06])), (0, 0, 0), YELLOW),
    part("short", Box(np.array([0.5, 0.08, 0.06])), (0, 0.15, 0), BLUE),
    part("head", Ellipsoid(np.array([0.07, 0.09, 0.07])), (0, 0.4, 0.03), RED),
)
BALL = rigid_body(part("ball", Ellipsoid(np.array([0.2, 0.2, 0.2])), (0, 0, 0), YELLOW))
SPINDLE = rigid_body(part("spindle", Ellipsoid(np.array([0.12, 0.12, 0.35])), (0, 0, 0), YELLOW))


def _limb(name: str, parent: str | None, joint, semi_axes, centre, colour) -> Segment:
    limits = JointLimits.from_angles(np.radians([[-120.0, 120.0]] * 3))
    return Segment(
        name, parent, np.array(joint, float), (part(name, Ellipsoid(np.array(semi_axes)), centre, colour),), limits
    )


GREEN, WHITE = (40.0, 150.0, 60.0), (210.0, 210.0, 200.0)
FIGURE = BodyModel(  # a trunk with two arms of two pieces, and a leg
    "figure",
    (
        _limb("trunk", None, (0, 0, 0), (0.12, 0.08, 0.25), (0, 0, 0), BLUE),
        _limb("upper_left", "trunk", (0.14, 0, 0.18), (0.045, 0.045, 0.14), (0, 0, -0.12), YELLOW),
        _limb("lower_left", "upper_left", (0, 0, -0.24), (0.035, 0.05, 0.12), (0, 0, -0.1), RED),
        _limb("upper_right", "trunk", (-0.14, 0, 0.18), (0.045, 0.045, 0.14), (0, 0, -0.12), YELLOW),
        _limb("lower_right", "upper_right", (0, 0, -0.24), (0.035, 0.05, 0.12), (0, 0, -0.1), GREEN),
        _limb("leg", "trunk", (0, 0, -0.22), (0.06, 0.07, 0.2), (0, 0, -0.18), WHITE),
    ),
)


def standing(time_s: Fraction) -> Pose:
    """The figure, arms out to the sides and bent, turning slowly."""
    t = float(time_s)
    angles = np.array([[0.3, -0.9, 0], [-0.5, -0.2, 0], [-0.2, 0.8, 0], [-0.6, 0.1, 0], [0.3, 0.1, 0]])
    swing = np.array([[1.0, -2.0, 0], [-1.5, 0, 0], [-1.0, 2.5, 0], [-1.0, 0, 0], [1.5, 0, 0]])
    root = RigidTransform.from_components([0.3 * t, 0.1 * t, 1.4], Rotation.from_euler("xyz", [0.1, 0.05, 0.3 + t]))
    return Pose(world_from_root=root, joint_angles=angles + swing * np.sin(4 * t))


def camera(name: str, turn: float, focal_px: float = 400.0) -> Camera:
    """A camera 4 m from the place of the throw, `turn` [rad] round the vertical; 100 px a metre by default."""
    centre, target = np.array([4 * np.sin(turn), -4 * np.cos(turn), 1.9]), np.array([0.0, 0.0, 1.4])
    z = (target - centre) / np.linalg.norm(target - centre)
    x = np.cross(z, [0, 0, 1.0]) / np.linalg.norm(np.cross(z, [0, 0, 1.0]))
    rotation = Rotation.from_matrix(np.stack([x, np.cross(z, x), z]))
    K = np.array([[focal_px, 0, (SIZE[0] - 1) / 2], [0, focal_px, (SIZE[1] - 1) / 2], [0, 0, 1.0]])
    place = RigidTransform.from_components(-rotation.apply(centre), rotation)
    return Camera(name=name, K=K, size=SIZE, camera_from_world=place)


TURNS = (0.0, 1.4, 2.7, -1.1)
CAMERAS = tuple(camera(f"cam{i}", turn) for i, turn in enumerate(TURNS))


def thrown(time_s: Fraction) -> Pose:
    """Where the body is: thrown up at 1 m/s, turning at 5 rad/s."""
    t = float(time_s)
    place = np.array([-0.1, 0.05, 1.35]) + np.array([0.6, 0.2, 1.0]) * t + 0.5 * GRAVITY * t**2
    turn = Rotation.from_rotvec(np.array([3.5, 1.0, 3.4]) * t) * Rotation.from_euler("xyz", [0.4, 0.3, 0.9])
    return Pose(world_from_root=RigidTransform.from_components(place, turn))


def clutter(seed: int, *colours) -> np.ndarray:
    """A background (h, w, 3), linear light: soft blotches, sharp dull boxes, and boxes of the given sRGB colours."""
    rng = np.random.default_rng(seed)
    picture = cv2.resize(rng.uniform(70, 150, (6, 8, 3)), SIZE, interpolation=cv2.INTER_CUBIC)
    dull = [np.full(3, grey) + rng.uniform(-12, 12, 3) for grey in rng.uniform(50, 170, 12)]
    for colour in (*dull, *colours):
        x, y = rng.integers(0, SIZE[0] - 40), rng.integers(0, SIZE[1] - 40)
        picture[y : y + rng.integers(10, 40), x : x + rng.integers(10, 40)] = colour
    return light_from_srgb(picture).astype(np.float32)


_LATELY: dict[tuple, tuple[np.ndarray, np.ndarray]] = {}  # bodies drawn
_N_LATELY = 100


@dataclass(frozen=True)
class Scene:
    """What is filmed; every picture is a pure function of it."""

    model: BodyModel = CROSS
    motion: Callable[[Fraction], Pose | None] = thrown  # None: the body is not there
    cameras: Sequence[Camera] = CAMERAS
    backgrounds: Sequence[np.ndarray] = tuple(clutter(seed) for seed in range(4))
    brightness: Callable[[int], float] = lambda index: 1.0
    noise_grey: float = 2.0
    is_dark: Callable[[int, str], bool] = lambda index, name: False  # a camera without an image at a frame
    reach: float = REACH
    _rendered: dict[int, Frames] = field(default_factory=dict, init=False)

    def frames(self, index: int) -> Frames:
        """Render a frame, once."""
        if index not in self._rendered:
            self._rendered[index] = self._render(index)
        return self._rendered[index]

    def _render(self, index: int) -> Frames:
        time_s = Fraction(index, FPS)
        pose = self.motion(time_s)
        views = [
            None if self.is_dark(index, seen_by.name) else View(seen_by, self._picture(index, i, seen_by, pose))
            for i, seen_by in enumerate(self.cameras)
        ]
        return Frames(index, time_s, tuple(views))

    def _picture(self, index: int, i: int, seen_by: Camera, pose: Pose | None) -> np.ndarray:
        light = self.backgrounds[i]
        if pose is not None:
            share, shown = _drawn_lately(self.model, pose, seen_by, self.reach)
            light = (1 - share) * light + shown
        rng = np.random.default_rng([index, i])
        noise = self.noise_grey * rng.standard_normal(light.shape, np.float32)
        noisy = srgb_from_light(light * np.float32(self.brightness(index))) + noise
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)

    def start(self, index: int = 0) -> Pose:
        """The true pose, of a frame that shows the body."""
        pose = self.motion(Fraction(index, FPS))
        assert pose is not None
        return pose


def srgb_from_light(light: np.ndarray) -> np.ndarray:
    """Turn linear light 0..1 into sRGB 0..255, any shape; brighter light is cut."""
    return SRGB[np.rint(np.clip(light, 0, 1) * (len(SRGB) - 1)).astype(int)]


def _drawn_lately(model: BodyModel, pose: Pose, seen_by: Camera, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """What `_drawn` returns: scenes differ in light, noise or which cameras see, and show the same."""
    place, angles = pose.world_from_root.as_matrix().tobytes(), pose.joint_angles.tobytes()
    key = model, place, angles, seen_by, reach
    if key not in _LATELY:
        if len(_LATELY) == _N_LATELY:
            del _LATELY[next(iter(_LATELY))]
        _LATELY[key] = _drawn(model, pose, seen_by, reach)
    return _LATELY[key]


def _drawn(model: BodyModel, pose: Pose, seen_by: Camera, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """The body's share of each pixel (h, w, 1), and its linear light in it (h, w, 3): averaged over finer pixels."""
    width, height = SIZE
    fine_size = (FINER * width, FINER * height)
    offset = -(FINER - 1) / (2 * FINER)
    fine = seen_by.resample(scale=(1 / FINER, 1 / FINER), offset=(offset, offset), size=fine_size)
    share, shown = np.zeros((height, width, 1), np.float32), np.zeros((height, width, 3), np.float32)
    reach_px = round(reach * seen_by.K[0, 0])
    u, v = np.rint(seen_by.px_from_world(pose.world_from_root.translation)).astype(int)
    x0, x1 = np.clip([u - reach_px, u + reach_px], 0, width)
    y0, y1 = np.clip([v - reach_px, v + reach_px], 0, height)
    if x0 < x1 and y0 < y1:
        posed, flat = model.with_pose(pose), surface_arrays(model)
        drawn = render(flat, posed, fine, LIGHTS, region=(FINER * x0, FINER * y0, FINER * x1, FINER * y1))
        red = np.append(flat.colours[:, 0], 1.0)[drawn.part]  # the last one stands for no part
        albedo = np.append(light_from_srgb(flat.colours), np.zeros((1, 3)), axis=0).astype(np.float32)
        light = albedo[drawn.part] * (drawn.colour[..., 0] / red)[..., None].astype(np.float32)
        size = (int(x1 - x0), int(y1 - y0))
        share[y0:y1, x0:x1, 0] = cv2.resize(drawn.mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        shown[y0:y1, x0:x1] = cv2.resize(light, size, interpolation=cv2.INTER_AREA)
    return share, shown


def track(scene: Scene, indices: Sequence[int], tracker: Tracker | None = None) -> list[Estimate]:
    """Track the frames of the scene, by `RefinedTracker` from the true pose of the first if no tracker is given."""
    tracker = tracker or RefinedTracker(scene.model, scene.start(indices[0]))
    state, estimates = tracker.init(), []
    for index in indices:
        state, estimate = step(tracker, state, scene.frames(index))
        estimates.append(estimate)
    return estimates


def errors(scene: Scene, estimate: Estimate) -> tuple[float, float]:
    """How far an estimate is from the truth: [mm], [degrees]."""
    truth = scene.motion(estimate.time_s)
    assert truth is not None and estimate.pose is not None
    return difference(truth, estimate.pose)


def difference(a: Pose, b: Pose) -> tuple[float, float]:
    """How far two poses are apart: [mm], [degrees]."""
    between = a.world_from_root.inv() * b.world_from_root
    return 1000 * float(np.linalg.norm(between.translation)), float(np.degrees(between.rotation.magnitude()))


def worst(scene: Scene, estimates: Sequence[Estimate]) -> tuple[float, float]:
    """The largest errors of the estimates that have a pose: [mm], [degrees]."""
    both = np.array([errors(scene, estimate) for estimate in estimates if estimate.pose is not None])
    return float(both[:, 0].max()), float(both[:, 1].max())


def statuses(estimates: Sequence[Estimate]) -> list[str]:
    """Their statuses; those that are uncertain say why, and others have nothing to say."""
    for each in estimates:
        assert bool(each.doubts) == (each.status is Status.UNCERTAIN), each
    return [str(estimate.status) for estimate in estimates]
