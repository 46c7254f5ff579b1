"""Rigs with truth, and boards and points that they see."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle import Source
from airborne.calibration.initial.chaining import Views
from airborne.calibration.sources.boards import Board, DetectedCorners
from airborne.cameras import Rig, camera_looking_at

SIZE = (1280, 720)
MIDDLE = np.array([0.0, 0.0, 1.0])
BOARD = Board(kind="charuco", columns=7, rows=6, square_m=0.1, marker_m=0.075)
BROWN = np.array([-0.2, 0.06, 0.001, -0.0005, 0.0])
FISHEYE = np.array([-0.03, 0.01, -0.002, 0.0005])


def ring(n=4, *, distortion=BROWN, lens="brown"):
    """Cameras around the origin, each with its own focal length."""
    found = []
    for i in range(n):
        angle = 2 * np.pi * i / n
        place = [3.0 * np.cos(angle), 3.0 * np.sin(angle), 1.6 + 0.2 * i]
        camera = camera_looking_at(f"cam{i}", place, [0, 0, 1.0], focal_px=900 + 40 * i, size=SIZE)
        found.append(replace(camera, distortion=distortion.copy(), lens=lens))
    return Rig(tuple(found))


def boards(rng, n=40):
    """Places of a board that is turned about in the middle."""
    return RigidTransform.from_components(rng.uniform(-0.5, 0.5, (n, 3)) + MIDDLE, Rotation.random(n, rng=rng))


def observe_board(rng, rig, places, *, noise_px=0.3, board=BOARD, moving=None):
    """What the rig sees of the board's front; moving: each camera's own places instead."""
    rows = []
    for i, camera in enumerate(rig):
        row = []
        for place in moving[i] if moving is not None else places:
            world = place.apply(board.corners)
            toward = camera.centre - place.translation
            is_front = place.rotation.apply([0, 0, -1]) @ toward > 0.3 * np.linalg.norm(toward)
            px = camera.px_from_world(world)
            inside = np.isfinite(px).all(axis=1) & (px >= 0).all(axis=1) & (px < np.array(camera.size) - 1).all(axis=1)
            kept = np.flatnonzero(inside) if is_front and inside.sum() > 9 else np.zeros(0, int)
            row.append(DetectedCorners(kept, px[kept] + noise_px * rng.standard_normal((len(kept), 2))))
        rows.append(tuple(row))
    return Views(board, rig.names, tuple(rows))


def observe_points(rng, rig, points, *, noise_px=0.5, name="points", is_free=None, start=None):
    """World points (n, 3) as every camera sees them."""
    px = np.stack([camera.px_from_world(points) for camera in rig], axis=1)
    point, camera = np.nonzero(np.isfinite(px).all(axis=-1))
    return Source(
        name=name,
        camera=camera,
        point=point,
        px=px[point, camera] + noise_px * rng.standard_normal((len(point), 2)),
        points=points if start is None else start,
        is_free=is_free,
    )


def shaken(rng, rig, *, shift_m=0.05, turn_rad=0.02, focal_px=20.0):
    """The rig with errors, and lenses without distortion."""
    found = []
    for camera in rig:
        error = RigidTransform.from_components(
            rng.normal(0, shift_m, 3), Rotation.from_rotvec(rng.normal(0, turn_rad, 3))
        )
        K = camera.K.copy()
        K[[0, 1], [0, 1]] += rng.normal(0, focal_px)
        place = error * camera.camera_from_world
        found.append(replace(camera, K=K, camera_from_world=place, distortion=np.zeros_like(camera.distortion)))
    return Rig(tuple(found))


def apart(rig):
    """Distances between all cameras [m]."""
    centres = np.stack([camera.centre for camera in rig])
    return np.linalg.norm(centres[:, None] - centres[None], axis=-1)
