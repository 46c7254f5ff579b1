"""Initial cameras from a wand where lenses are fisheyes, whose focal length must be known to straighten them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.calibration.initial.wand import initial_rig_from_wand, wand_scale
from airborne.calibration.sources.wand import WandTracks
from airborne.cameras.camera import Camera, Rig
from airborne.errors import CalibrationError

_FOCAL_RATIOS = np.geomspace(0.25, 1.0, 8)  # focal length over the image's longer side: 230 to 57 degrees


def initial_rig_from_wand_and_fisheyes(
    tracks: WandTracks, sizes: Mapping[str, tuple[int, int]], lenses: Mapping[str, Camera], fisheyes: Sequence[str]
) -> Rig:
    """Return initial values as `initial_rig_from_wand`, of some focal lengths for all fisheyes that which fits best.

    It keeps the wand's length most constant. Raises CalibrationError where none fits.
    """
    best, least, refusal = None, np.inf, None
    for ratio in _FOCAL_RATIOS:
        guesses = {name: _fisheye(name, sizes[name], ratio) for name in fisheyes}
        try:
            rig = initial_rig_from_wand(tracks, sizes, {**lenses, **guesses})
        except CalibrationError as error:
            refusal = refusal or error
            continue
        _, variation = wand_scale(rig.points_from_px(tracks.px), np.isfinite(tracks.px[..., 0]).sum(axis=2) > 1, tracks)
        best, least = (rig, variation) if variation < least else (best, least)
    if best is None:
        raise refusal or CalibrationError("no focal length fits the wand; are the lenses fisheyes?")
    return best


def _fisheye(name: str, size: tuple[int, int], ratio: float) -> Camera:
    f, middle = ratio * max(size), (np.array(size) - 1) / 2
    return Camera(
        name=name,
        K=np.array([[f, 0, middle[0]], [0, f, middle[1]], [0, 0, 1]]),
        size=size,
        camera_from_world=RigidTransform.identity(),
        distortion=np.zeros(4),
        lens="fisheye",
    )
