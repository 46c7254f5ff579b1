"""Small clips with truth: players squat and hop on a floor, drawn with the tracker's own body, 65 pixels a metre."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Camera, Rig, write_pose2sim
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.first_frame import points_of
from airborne.tracking.capsules.jumper import JOINTS, N_DOF
from airborne.tracking.capsules.surface_colours import class_image
from airborne.tracking.players import PlayerEstimate, PlayerStart
from airborne.video import Frames, View
from tests.support.clips import write_clip

SIZE, FPS = (480, 240), 50  # cut out of 640 x 480
LENGTHS = np.array([0.11, 0.46, 0.31, 0.41, 0.125, 0.45, 0.44, 0.145, 0.07])
RADII = np.array([0.105, 0.09, 0.085, 0.06, 0.043, 0.046, 0.085, 0.045])
COLOURS = np.array([[150, 40, 60], [30, 30, 45], [205, 155, 125], [225, 225, 220], [60, 110, 60]], float)
FLOOR = np.array([165.0, 150.0, 105.0])
SIDE_BY_SIDE = np.array([0.75, 0.0])  # [m]
SQUAT_S, PUSH_S, TAKE_OFF_M_S, G = 0.40, 0.14, 2.1, 9.81
STANDING, SQUATTING, STRAIGHT = 0.15, 0.60, 0.12  # a leg's bend at the hip, half of the knee's [rad]
N_FRAMES = 50


def camera(angle: float, number: int = 0) -> Camera:
    """A camera 9 m away, 2.8 m high, `angle` [rad] about the vertical from behind (y < 0)."""
    centre, target = np.array([9 * np.sin(angle), -9 * np.cos(angle), 2.8]), np.array([0.35, 0.0, 1.0])
    z = (target - centre) / np.linalg.norm(target - centre)
    x = np.cross(z, [0, 0, 1.0]) / np.linalg.norm(np.cross(z, [0, 0, 1.0]))
    rotation = Rotation.from_matrix(np.stack([x, np.cross(z, x), z]))
    K = np.array([[600.0, 0, (SIZE[0] - 1) / 2], [0, 600.0, (SIZE[1] - 1) / 2 - 20], [0, 0, 1.0]])
    camera_from_world = RigidTransform.from_components(-rotation.apply(centre), rotation)
    return Camera(name=f"cam{number}", K=K, size=SIZE, camera_from_world=camera_from_world)


CAMERAS = tuple(camera(angle, i) for i, angle in enumerate((-0.75, 0.1, 0.8)))


def _bend(t: float) -> tuple[float, float]:
    """The legs' bend [rad] and how high the feet are [m], at a time [s] of the hop."""
    leg_m = LENGTHS[5] + LENGTHS[6]
    squat, straight = leg_m * np.cos(SQUATTING), leg_m * np.cos(STRAIGHT)
    push_s = 2 * (straight - squat) / TAKE_OFF_M_S
    flight_s = 2 * TAKE_OFF_M_S / G
    if t < SQUAT_S:
        return STANDING + (SQUATTING - STANDING) * (1 - np.cos(np.pi * t / SQUAT_S)) / 2, 0.0
    t -= SQUAT_S
    if t < push_s:
        return float(np.arccos((squat + (straight - squat) * (t / push_s) ** 2) / leg_m)), 0.0
    t -= push_s
    if t < flight_s:
        return STRAIGHT + 0.15 * np.sin(np.pi * t / flight_s), TAKE_OFF_M_S * t - G * t**2 / 2
    return min(STRAIGHT + 3.0 * (t - flight_s), SQUATTING), 0.0


def hop(
    position: Sequence[float] = (0.0, 0.0), heading: float = 0.3, late_s: float = 0.0
) -> Callable[[float], np.ndarray]:
    """A hop with the feet about a position (2,) [m] on the floor: t [s] -> state (35,)."""

    def state_at(t: float) -> np.ndarray:
        bend, lift = _bend(max(t - late_s, 0.0))
        lean = 0.1 + 0.3 * bend
        pose = np.zeros(N_DOF)
        pose[:2], pose[3], pose[5], pose[6] = position, heading, lean, 0.1
        for first, sign in ((8, 1.0), (13, -1.0)):
            point = 0.35 * min(lift / 0.1, 1.0)
            pose[first : first + 5] = -bend - lean, -0.06 * sign, 0.1 * sign, 2 * bend, -bend + point
        state = np.concatenate([pose, LENGTHS, RADII])
        feet = points_of(state)[6:8]
        state[:2] += np.asarray(position) - feet.mean(axis=0)[:2]
        state[2] = 0.03 + lift - feet[:, 2].min()
        return state

    return state_at


def walk(start: Sequence[float], speed: Sequence[float], heading: float) -> Callable[[float], np.ndarray]:
    """A hop that glides over the floor at a speed (2,) [m/s]."""
    hopping = hop(start, heading)

    def state_at(t: float) -> np.ndarray:
        state = hopping(t)
        state[:2] += t * np.asarray(speed)
        return state

    return state_at


@cache
def _floor(number: int) -> np.ndarray:
    """An uneven floor (h, w, 3), the same in every image of a camera."""
    rng = np.random.default_rng([7, number])
    coarse = rng.normal(scale=14, size=(SIZE[1] // 16, SIZE[0] // 16, 1)).repeat(16, axis=0).repeat(16, axis=1)
    return (FLOOR + coarse + rng.normal(scale=4, size=(*SIZE[::-1], 3))).astype(np.float32)


@cache
def _grain() -> np.ndarray:
    """Noise [grey levels] of which every image takes its own crop."""
    return np.random.default_rng(5).normal(scale=5, size=(SIZE[1] + 97, SIZE[0] + 97, 3)).astype(np.float32)


@dataclass(frozen=True)
class Hall:
    """What is filmed; every image is a pure function of it."""

    motions: dict[str, Callable[[float], np.ndarray]]
    cameras: Sequence[Camera] = CAMERAS
    is_without: Callable[[int, int], bool] = lambda index, number: False  # a camera without an image at a frame
    is_black: Callable[[int, int], bool] = lambda index, number: False  # or with a black one
    is_noise: Callable[[int, int], bool] = lambda index, number: False  # or with one that shows nothing
    is_there: Callable[[int], bool] = lambda index: True  # whether the players are
    seed: int = 0

    def frames(self, index: int) -> Frames:
        views = [None if self.is_without(index, i) else self._view(index, i) for i in range(len(self.cameras))]
        return Frames(index, Fraction(index, FPS), tuple(views))

    def _view(self, index: int, number: int) -> View:
        view_camera, rng = self.cameras[number], np.random.default_rng([self.seed, index, number])
        width, height = view_camera.size
        if self.is_black(index, number):
            return View(view_camera, np.zeros((height, width, 3), np.uint8))
        if self.is_noise(index, number):
            return View(view_camera, rng.integers(0, 256, (height, width, 3), np.uint8))
        image = _floor(number)[:height, :width].copy()
        for state in self._far_to_near(index, view_camera) if self.is_there(index) else ():
            surface_class = class_image(state, view_camera, 1.0)
            image[surface_class >= 0] = COLOURS[surface_class[surface_class >= 0]]
        x, y = rng.integers(0, 97, 2)
        image += _grain()[y : y + height, x : x + width]
        return View(view_camera, np.clip(image, 0, 255).astype(np.uint8))

    def _far_to_near(self, index: int, view_camera: Camera) -> list[np.ndarray]:
        states = [motion(index / FPS) for motion in self.motions.values()]
        return sorted(states, key=lambda state: -view_camera.camera_from_world.apply(state[:3])[2])

    def truth(self, name: str, index: int) -> np.ndarray:
        """A player's joints (9, 3) [m]."""
        return points_of(self.motions[name](index / FPS))

    def starts(self, wrong_m: float = 0.01, index: int = 0) -> list[PlayerStart]:
        """The players as if set by hand, each joint wrong by a length [m] in some direction."""
        starts = []
        for number, name in enumerate(self.motions):
            off = np.random.default_rng([11, number]).normal(size=(len(JOINTS), 3))
            off *= wrong_m / np.linalg.norm(off, axis=1, keepdims=True)
            points: dict[str, np.ndarray] = dict(zip(JOINTS, self.truth(name, index) + off, strict=True))
            starts.append(PlayerStart(name=name, joints_m=points))
        return starts

    def write_trial(
        self, folder: Path, n: int, *, ahead: Sequence[int] = (0, 0, 0), videos: Sequence[str] | None = None
    ) -> Path:
        """Write n frames as a trial, and return its path.

        Each camera's video begins so many frames `ahead` of the first; `videos` names the camera whose video each has.
        """
        names = [camera.name for camera in self.cameras]
        for i, name in enumerate(names):
            images = [self.frames(index + ahead[i]).views[i] for index in range(n)]
            write_clip(folder / f"{name}.mkv", [view.rgb for view in images if view is not None], rate=Fraction(FPS))
        write_pose2sim(folder / "calib.toml", Rig(tuple(self.cameras)))
        pairs = zip(names, videos or names, strict=True)
        lines = ['name = "hall"', *(f'[[camera]]\nname = "{name}"\nvideo = "{video}.mkv"' for name, video in pairs)]
        lines += ['[calibration]\nfile = "calib.toml"\n[body]\npreset = "legs"\n[start]\nframe = 0']
        for player in self.starts():
            lines += [f'[[start.player]]\nname = "{player.name}"\n[start.player.joints_m]']
            lines += [f"{joint} = {point.round(4).tolist()}" for joint, point in player.joints_m.items()]
        path = folder / "trial.toml"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path


def tracked(hall: Hall, indices: Sequence[int], starts: list[PlayerStart] | None = None) -> list[list[PlayerEstimate]]:
    """Track some frames; return each player's estimates, in the order of the starts."""
    blocker = Blocker(starts or hall.starts(index=indices[0]))
    state, steps = blocker.init(), []
    for index in indices:
        state, estimates = blocker.step(state, hall.frames(index))
        steps.append(estimates)
    return [list(each) for each in zip(*steps, strict=True)]


def errors_mm(hall: Hall, estimates: Sequence[PlayerEstimate]) -> np.ndarray:
    """How far hips, knees and ankles are from the truth: (frames, 6) [mm], NaN where lost."""
    truth = np.array([hall.truth(each.player, each.index) for each in estimates])
    points = np.array([each.points for each in estimates])
    return 1000 * np.linalg.norm(points - truth, axis=-1)[:, :6]


def share_within(hall: Hall, estimates: Sequence[PlayerEstimate]) -> float:
    """The share of hips, knees and ankles whose truth lies in the estimate's own 95 % region."""
    inside = []
    for each in estimates:
        off = (each.points - hall.truth(each.player, each.index))[:6, :, None]
        squared = (off.swapaxes(1, 2) @ np.linalg.solve(each.covariance[:6], off))[:, 0, 0]
        inside.append(squared < 7.815)  # chi squared, 3 degrees of freedom
    return float(np.mean(inside))


def statuses(estimates: Sequence[PlayerEstimate]) -> list[Status]:
    return [each.status for each in estimates]
