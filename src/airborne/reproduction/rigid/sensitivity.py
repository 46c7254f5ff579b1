"""Sensitivity of the errors to wrong lights, cameras and body and to image noise: one perturbation at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, human18
from airborne.body.outfits import with_flat_colours
from airborne.cameras import Camera
from airborne.rendering import Lamp, Lights
from airborne.reproduction.rigid.somersaults import (
    Experiment,
    RigidMethod,
    RunErrors,
    make_experiment,
    track_experiment,
)
from airborne.synthetic.flight.somersault import MASS_KG, STATURE_M
from airborne.video import Frames, View

_MIDDLE_M = np.array([0.0, 0.0, 1.5])  # of the flight: lamps rotate about it


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A perturbation of experiment the tracker is given, or of the images."""

    name: str
    rotation_rad: float = 0.0  # of the lamps, about the vertical through the flight's middle
    power: float = 1.0  # of the lamps
    camera_sd_px: float = 0.0  # error of each camera's direction, right and down, in its image
    noise: float = 0.0  # of the images [grey levels]
    size: float = 1.0  # of the body


CASES = (
    Case(name="lamps turned by 10 deg", rotation_rad=np.radians(10)),
    Case(name="lamps turned by 20 deg", rotation_rad=np.radians(20)),
    Case(name="lamps 20 % too strong", power=1.2),
    Case(name="lamps 20 % too weak", power=0.8),
    Case(name="cameras off by 0.5 px", camera_sd_px=0.5),
    Case(name="cameras off by 1 px", camera_sd_px=1.0),
    Case(name="cameras off by 2 px", camera_sd_px=2.0),
    Case(name="noise of 5 grey levels", noise=5.0),
    Case(name="noise of 20 grey levels", noise=20.0),
    Case(name="body 5 % too big", size=1.05),
)


def run_case(
    case: Case, unperturbed: Experiment, method: RigidMethod, progress: Callable[[], None] = lambda: None
) -> RunErrors:
    """Track the somersault with the case's perturbation; progress is called after every pose."""
    experiment = (
        unperturbed if case.noise == 0 else make_experiment("skin", n_poses=len(unperturbed.poses), noise=case.noise)
    )
    errors, _ = track_experiment(
        experiment,
        method,
        model=scale_body(experiment.model, case.size),
        lights=perturb_lights(experiment.lights, rotation_rad=case.rotation_rad, power=case.power),
        frames=perturb_cameras(experiment.frames, case.camera_sd_px),
        progress=progress,
    )
    return errors


def perturb_lights(lights: Lights, *, rotation_rad: float, power: float) -> Lights:
    """Rotate the lamps about the vertical through the flight's middle, and change their power."""
    rotation = Rotation.from_rotvec([0, 0, rotation_rad])
    lamps = tuple(
        Lamp(rotation.apply(lamp.position_m - _MIDDLE_M) + _MIDDLE_M, power * lamp.intensity) for lamp in lights.lamps
    )
    return Lights(lights.ambient, lamps)


def scale_body(model: BodyModel, size: float) -> BodyModel:
    """Return the somersault's body, `size` times as large in every direction."""
    return model if size == 1 else with_flat_colours(human18(size * STATURE_M, size**3 * MASS_KG))


def perturb_cameras(frames: tuple[Frames, ...], sd_px: float, seed: int = 0) -> tuple[Frames, ...]:
    """Perturb every camera's direction, right and down, by normal errors of `sd_px` in its image."""
    if sd_px == 0:
        return frames
    rng = np.random.default_rng(seed)
    cameras: dict[str, Camera] = {}
    for view in frames[0].views:
        assert view is not None
        right, down = rng.normal(0, sd_px, 2) / (view.camera.K[0, 0], view.camera.K[1, 1])
        rotation = RigidTransform.from_rotation(Rotation.from_rotvec([down, -right, 0.0]))
        cameras[view.camera.name] = replace(view.camera, camera_from_world=rotation * view.camera.camera_from_world)
    return tuple(
        replace(frame, views=tuple(view and View(cameras[view.camera.name], view.rgb) for view in frame.views))
        for frame in frames
    )
