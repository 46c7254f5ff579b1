"""Cameras around a flight: where they stand, what they see, their calibration as Calib.toml."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from people import Person
from rotations import rotation_vector_of

SIZE = (1280, 720)  # width, height [px]
PRINCIPAL_POINT = np.array([639.5, 359.5])  # [px], the middle of the image; pixel centres at whole numbers
_TWO_APART_DEG = 80  # chosen: of two cameras; more stand evenly around
_SCALE_PX_PER_M = (150, 175)  # chosen: of the person in the images


class Camera(NamedTuple):
    """A pinhole camera without distortion: x right, y down, z forward."""

    R: np.ndarray  # (3, 3) camera from world
    t: np.ndarray  # (3,) [m]
    focal_px: float
    place_m: np.ndarray  # (3,)


def place_cameras(rng: np.random.Generator, person: Person, centres_m: np.ndarray) -> list[Camera]:
    """Return cameras that look at the middle of a flight's centres of mass (n, 3) [m]."""
    n = person.n_cameras
    x, y = centres_m[len(centres_m) // 2, :2]
    first = rng.uniform(0, 2 * np.pi)
    apart = 2 * np.pi / n if n > 2 else np.radians(_TWO_APART_DEG)
    cameras = []
    for azimuth in first + np.arange(n) * apart + rng.uniform(-0.25, 0.25, n):
        away_m, height_m = rng.uniform(6.5, 8.8), rng.uniform(1.1, 3.2)
        place_m = np.array([x + away_m * np.cos(azimuth), y + away_m * np.sin(azimuth), height_m])
        aim_m = np.array([x, y, centres_m[:, 2].mean()]) + rng.normal(0, 0.1, 3)
        distance_m = np.linalg.norm(aim_m - place_m)
        forward = (aim_m - place_m) / distance_m
        focal_px = rng.uniform(*_SCALE_PX_PER_M) * distance_m
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        roll = rng.normal(0, 0.02)
        c, s = np.cos(roll), np.sin(roll)
        R = np.array([right * c + down * s, down * c - right * s, forward])
        cameras.append(Camera(R, -R @ place_m, float(focal_px), place_m))
    return cameras


def project(camera: Camera, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) [m] in the image (n, 2) [px], and their depths (n,) [m]."""
    in_camera = points_m @ camera.R.T + camera.t
    depth_m = in_camera[:, 2].copy()
    return in_camera[:, :2] / depth_m[:, None] * camera.focal_px + PRINCIPAL_POINT, depth_m


def write_calibration(path: Path, cameras: list[Camera]) -> None:
    """Write cameras as cam1, cam2, ... in the format of Pose2Sim's Calib.toml."""
    cx, cy = PRINCIPAL_POINT
    tables = []
    for number, camera in enumerate(cameras, start=1):
        f = camera.focal_px
        tables += [
            f"[cam{number}]",
            f'name = "cam{number}"',
            f"size = [{SIZE[0]}.0, {SIZE[1]}.0]",
            f"matrix = [[{f}, 0.0, {cx}], [0.0, {f}, {cy}], [0.0, 0.0, 1.0]]",
            "distortions = [0.0, 0.0, 0.0, 0.0]",
            f"rotation = {rotation_vector_of(camera.R).tolist()}",
            f"translation = {camera.t.tolist()}",
            "fisheye = false",
            "",
        ]
    path.write_text("\n".join(tables), encoding="utf-8")
