"""A hall with four cameras, a wand waved in it, and clicked points of its court."""

from dataclasses import replace

import numpy as np

from airborne.calibration.sources.control_points import ControlPoints
from airborne.calibration.sources.court import court_points
from airborne.calibration.sources.wand import WandTracks
from airborne.cameras import Rig, camera_looking_at

SIZE = (1920, 1080)
PLACES = [(-7, -9, 3.0), (7, -9, 4.0), (8, 7, 3.5), (-8, 6, 3.0)]
FOCALS_PX = (900.0, 1500.0, 2500.0, 1500.0)
SIZES = {f"cam{i + 1}": SIZE for i in range(4)}


def hall(focals_px=FOCALS_PX, k1=0.0) -> Rig:
    """Four cameras in the corners."""
    rig = [
        camera_looking_at(f"cam{i + 1}", place, (0.3 * i, 0.2, 1.4), focal_px=focals_px[i], size=SIZE)
        for i, place in enumerate(PLACES)
    ]
    return Rig(tuple(replace(camera, distortion=np.array([k1, 0, 0, 0, 0])) for camera in rig))


def wave_wand(rng, n, lengths_m=(1.0,), middle=(0.0, 0.0, 1.6)):
    """Markers of a wand on one line (n, markers, 3) [m], anywhere in the middle, pointing anywhere."""
    first = np.array(middle) + rng.uniform((-3, -2, -1.2), (3, 2, 1.2), (n, 3))
    along = rng.normal(size=(n, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    return np.stack([first + length * along for length in (0, *np.cumsum(lengths_m))], axis=1)


def observe(rng, rig, points, *, noise_px=0.5, stray_share=0.0):
    """Pixels (..., cameras, 2) of points (..., 3), NaN outside the picture; some anywhere instead."""
    px = np.stack([camera.px_from_world(points) for camera in rig], axis=-2)
    px[~((px >= 0) & (px <= np.array(SIZE) - 1)).all(axis=-1)] = np.nan
    px += rng.normal(0, noise_px, px.shape)
    stray = rng.random(px.shape[:-1]) < stray_share
    px[stray] = rng.uniform((0, 0), SIZE, (stray.sum(), 2))
    return px


def tracks(rng, rig, n=200, *, lengths_m=(1.0,), stray_share=0.0, noise_px=0.5) -> WandTracks:
    """The wand as every camera sees it."""
    px = observe(rng, rig, wave_wand(rng, n, lengths_m), noise_px=noise_px, stray_share=stray_share)
    return WandTracks(cameras=rig.names, px=px, lengths_m={(i, i + 1): length for i, length in enumerate(lengths_m)})


def click_court(rng, rig, names=None, *, noise_px=0.5) -> ControlPoints:
    """The court's points as every camera sees them, painted as exactly as courts are."""
    known = court_points("men")
    names = tuple(names or known)
    world, sd_m = (np.array([getattr(known[name], key) for name in names]) for key in ("position_m", "sd_m"))
    px = observe(rng, rig, world + sd_m * rng.standard_normal(world.shape), noise_px=noise_px)
    return ControlPoints(names=names, world=world, cameras=rig.names, px=px, sd_m=sd_m)


def misplaced_m(rig, found):
    """How far cameras stand from the truth after the best fit of the whole rig without a change of scale [m]."""
    true, centres = (np.array([camera.centre for camera in each]) for each in (rig, found))
    a, b = true - true.mean(axis=0), centres - centres.mean(axis=0)
    left, _, right = np.linalg.svd(b.T @ a)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    return np.linalg.norm(b @ turn - a, axis=1)


def focal_errors(rig, found):
    """Relative errors of the focal lengths."""
    return np.array([camera.K[0, 0] / true.K[0, 0] - 1 for camera, true in zip(found, rig, strict=True)])
