"""What wrong lights, cameras, colours and a wrong body do to the errors: one thing wrong at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, human18
from airborne.body.outfits import in_flat_colours
from airborne.cameras import Camera
from airborne.rendering import Lamp, Lights
from airborne.reproduction.rigid.somersaults import Errors, Experiment, MethodName, experiment, tracked
from airborne.synthetic.flight.somersault import MASS_KG, STATURE_M
from airborne.video import Frames, View

Array = NDArray[np.floating]
_MIDDLE_M = np.array([0.0, 0.0, 1.5])  # of the flight: lamps turn about it


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What the tracker is told wrongly, or how noisy the pictures are."""

    name: str
    turned_rad: float = 0.0  # lamps, about the vertical through the flight's middle
    power: float = 1.0  # of the lamps
    camera_sd_px: float = 0.0  # how far each camera's direction is off, right and down, in its picture
    noise: float = 0.0  # of the pictures [grey levels]
    size: float = 1.0  # of the body


CASES = (
    Case(name="lamps turned by 10 deg", turned_rad=np.radians(10)),
    Case(name="lamps turned by 20 deg", turned_rad=np.radians(20)),
    Case(name="lamps 20 % too strong", power=1.2),
    Case(name="lamps 20 % too weak", power=0.8),
    Case(name="cameras off by 0.5 px", camera_sd_px=0.5),
    Case(name="cameras off by 1 px", camera_sd_px=1.0),
    Case(name="cameras off by 2 px", camera_sd_px=2.0),
    Case(name="noise of 5 grey levels", noise=5.0),
    Case(name="noise of 20 grey levels", noise=20.0),
    Case(name="body 5 % too big", size=1.05),
)


def run_case(case: Case, plain: Experiment, method: MethodName, progress: Callable[[], None] = lambda: None) -> Errors:
    """Track the somersault with the case's faults; progress is called after every pose."""
    what = plain if case.noise == 0 else experiment("skin", n_poses=len(plain.poses), noise=case.noise)
    errors, _ = tracked(
        what,
        method,
        model=sized(what.model, case.size),
        lights=wrong_lights(what.lights, turned_rad=case.turned_rad, power=case.power),
        frames=with_wrong_cameras(what.frames, case.camera_sd_px),
        progress=progress,
    )
    return errors


def wrong_lights(lights: Lights, *, turned_rad: float, power: float) -> Lights:
    """Turn the lamps about the vertical through the flight's middle, and change their power."""
    turn = Rotation.from_rotvec([0, 0, turned_rad])
    lamps = tuple(
        Lamp(turn.apply(lamp.position_m - _MIDDLE_M) + _MIDDLE_M, power * lamp.intensity) for lamp in lights.lamps
    )
    return Lights(lights.ambient, lamps)


def sized(model: BodyModel, size: float) -> BodyModel:
    """Return the somersault's body, `size` times as large in every direction."""
    return model if size == 1 else in_flat_colours(human18(size * STATURE_M, size**3 * MASS_KG))


def with_wrong_cameras(frames: tuple[Frames, ...], sd_px: float, seed: int = 0) -> tuple[Frames, ...]:
    """Say that every camera looks elsewhere than it did, right and down by normal errors of `sd_px` in its picture."""
    if sd_px == 0:
        return frames
    rng = np.random.default_rng(seed)
    cameras: dict[str, Camera] = {}
    for view in frames[0].views:
        assert view is not None
        right, down = rng.normal(0, sd_px, 2) / (view.camera.K[0, 0], view.camera.K[1, 1])
        turn = RigidTransform.from_rotation(Rotation.from_rotvec([down, -right, 0.0]))
        cameras[view.camera.name] = replace(view.camera, camera_from_world=turn * view.camera.camera_from_world)
    return tuple(
        replace(frame, views=tuple(view and View(cameras[view.camera.name], view.rgb) for view in frame.views))
        for frame in frames
    )
