"""Small images of players drawn as coloured rods on a court, with truth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.legs import LEG_POINTS
from airborne.cameras import Camera, Rig
from airborne.tracking.particle import GivenTorsos, LegsSettings, TorsoInput, legs_tracker
from airborne.tracking.particle.parts import WIDTHS_M, ends_of
from airborne.tracking.particle.rods import rod_corners
from airborne.tracking.players import PlayerEstimate, PlayerStart
from airborne.video import Frames, View

FPS, SIZE, FOCAL_PX = 60, (480, 360), 430.0
SHORTS, SKIN, SHOE, FLOOR = (28, 28, 32), (190, 140, 112), (225, 225, 220), (70, 120, 95)
RED, BLUE = (200, 45, 55), (40, 70, 190)
PART_COLOURS = (SHORTS, SHORTS, SKIN, SKIN, SKIN, SKIN, SHOE, SHOE)
STANDING = np.array(
    [
        [-0.12, 0, 0.95],
        [0.12, 0, 0.95],
        [-0.14, 0.12, 0.52],
        [0.14, 0.12, 0.52],
        [-0.15, 0, 0.10],
        [0.15, 0, 0.10],
    ]
)
TORSO = np.array([0.0, 0.02, 1.22])
TORSO_SIZE_M = (0.42, 0.55)
NOISE = np.random.default_rng(0).normal(0, 4, (SIZE[1] + 100, SIZE[0] + 100, 3)).round().astype(np.int16)


def camera(name: str, centre: Sequence[float]) -> Camera:
    """A camera that looks at the middle of the court, from behind the team."""
    at, target = np.array(centre), np.array([0.0, 0.0, 1.0])
    z = (target - at) / np.linalg.norm(target - at)
    x = np.cross(z, [0, 0, 1.0]) / np.linalg.norm(np.cross(z, [0, 0, 1.0]))
    rotation = Rotation.from_matrix(np.stack([x, np.cross(z, x), z]))
    K = np.array([[FOCAL_PX, 0, SIZE[0] / 2], [0, FOCAL_PX, SIZE[1] / 2], [0, 0, 1.0]])
    camera_from_world = RigidTransform.from_components(-rotation.apply(at), rotation)
    return Camera(name=name, K=K, size=SIZE, camera_from_world=camera_from_world)


RIG = Rig((camera("left", (-4, -4.5, 2.2)), camera("right", (4, -4.5, 2.2)), camera("behind", (0, -6, 2.5))))


def still(time_s: float) -> np.ndarray:
    """No displacement."""
    return np.zeros(3)


def jump(time_s: float) -> np.ndarray:
    """Stand for a tenth of a second, then fly, 2 m/s upward at first."""
    t = max(time_s - 0.1, 0.0)
    return np.array([0.3 * t, 0.0, max(2.0 * t - 4.905 * t * t, 0.0)])


@dataclass(frozen=True)
class Player:
    """Who is drawn; points and torso are moved as a whole."""

    name: str
    position: tuple[float, float] = (0.0, 0.0)
    shirt: tuple[int, int, int] = RED
    motion: Callable[[float], np.ndarray] = still
    has_legs: bool = True

    def points(self, time_s: float) -> np.ndarray:
        return STANDING + self.shift(time_s)

    def torso(self, time_s: float) -> np.ndarray:
        return TORSO + self.shift(time_s)

    def shift(self, time_s: float) -> np.ndarray:
        return np.array([*self.position, 0]) + self.motion(time_s)


@dataclass(frozen=True)
class Court:
    """What is filmed; every image is a pure function of it."""

    players: tuple[Player, ...] = (Player("one", motion=jump),)
    state: Callable[[int, str], str] = lambda index, name: "fine"  # or "none", "dark" or "empty"
    rig: Rig = RIG

    @lru_cache(maxsize=40)  # noqa: B019 - courts are few
    def frames(self, index: int) -> Frames:
        views = tuple(self._view(index, view_camera) for view_camera in self.rig)
        return Frames(index, Fraction(index, FPS), views)

    def starts(self) -> list[PlayerStart]:
        return [
            PlayerStart(
                name=player.name,
                joints_m={"torso": player.torso(0)}
                | (dict(zip(LEG_POINTS, player.points(0), strict=True)) if player.has_legs else {}),
            )
            for player in self.players
        ]

    def torsos(self, n: int) -> np.ndarray:
        return np.array([[player.torso(k / FPS) for player in self.players] for k in range(n)])

    def _view(self, index: int, view_camera: Camera) -> View | None:
        state = self.state(index, view_camera.name)
        if state == "none":
            return None
        if state == "dark":
            return View(view_camera, noisy(np.full((SIZE[1], SIZE[0], 3), 3, np.uint8), index, view_camera.name))
        image = np.full((SIZE[1], SIZE[0], 3), FLOOR, np.uint8)
        if state != "empty":
            nearest_last = sorted(
                self.players, key=lambda player: -np.linalg.norm(player.torso(index / FPS) - view_camera.centre)
            )
            for player in nearest_last:
                draw(image, view_camera, player, index / FPS)
        return View(view_camera, noisy(image, index, view_camera.name))


def noisy(image: np.ndarray, index: int, name: str) -> np.ndarray:
    """Add noise, cut at another offset for every image."""
    y, x = np.random.default_rng([index, *name.encode()]).integers(0, 100, 2)
    return cv2.add(image, NOISE[y : y + SIZE[1], x : x + SIZE[0]], dtype=cv2.CV_8U)


def draw(image: np.ndarray, view_camera: Camera, player: Player, time_s: float) -> None:
    ends = ends_of(player.points(time_s)[None])[0]
    corners = rod_corners(ends, view_camera.P, FOCAL_PX, WIDTHS_M)
    for part in (2, 3, 4, 5, 6, 7, 0, 1):
        fill(image, corners[part], PART_COLOURS[part])
    torso, half = player.torso(time_s), np.array([0, 0, TORSO_SIZE_M[1] / 2])
    shirt = rod_corners(np.array([[torso + half, torso - half]]), view_camera.P, FOCAL_PX, np.array([TORSO_SIZE_M[0]]))
    fill(image, shirt[0], player.shirt)


def fill(image: np.ndarray, outline: np.ndarray, colour: Sequence[int]) -> None:
    if np.isfinite(outline).all():
        cv2.fillConvexPoly(image, np.rint(16 * outline).astype(np.int32), list(colour), cv2.LINE_8, 4)


def track(
    court: Court, n: int, settings: LegsSettings, torso: TorsoInput | str = "given"
) -> list[tuple[PlayerEstimate, ...]]:
    """Track the first n frames, by default with the true torsos."""
    given = GivenTorsos(court.torsos(n)) if torso == "given" else None
    tracker = legs_tracker(settings, court.rig, court.starts(), given)
    state, estimates = tracker.init(), []
    for index in range(n):
        state, now = tracker.step(state, court.frames(index))
        estimates.append(now)
    return estimates


def errors_m(court: Court, estimates: Sequence[tuple[PlayerEstimate, ...]]) -> np.ndarray:
    """How far the points are from the truth: (frames, players with legs, 6); NaN when lost."""
    players = [player for player in court.players if player.has_legs]
    return np.array(
        [
            [np.linalg.norm(e.points - p.points(float(e.time_s)), axis=-1) for p, e in zip(players, step, strict=True)]
            for step in estimates
        ]
    )
