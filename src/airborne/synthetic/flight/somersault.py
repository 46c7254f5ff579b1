"""The half-twisting forward somersault of paper B: scenes of it from front, side and top."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, human18
from airborne.body.outfits import with_flat_colours
from airborne.body.skin import skin_of
from airborne.cameras import Rig, camera_looking_at
from airborne.errors import TrialError
from airborne.rendering import Lamp, Lights
from airborne.synthetic.flight.skill import N_POSES, half_twist
from airborne.synthetic.throw.scene import HALL_AMBIENT, PICTURE_SIZE, Scene, hall_spots
from airborne.synthetic.throw.surroundings import gym

SomersaultPreset = Literal["paper", "moving-arms", "pike"]
Target = Literal["skin", "ellipsoids"]
PictureStyle = Literal["exact", "gym"]

STATURE_M, MASS_KG = 1.66, 58.0  # [m], [kg] of the gymnast
LIGHTS = Lights(0.5, (Lamp(np.array([-3.0, -3.5, 4.2]), 0.4), Lamp(np.array([3.4, 2.2, 3.6]), 0.3)))
_CAMERAS = {  # position, target [m], focal length [px]
    "front": ((0.0, -6.3, 1.55), (0.0, 0.0, 1.55), 1000.0),
    "side": ((4.3, 0.0, 1.58), (0.0, 0.0, 1.58), 730.0),
    "top": ((0.6, 0.0, 7.2), (0.0, 0.0, 1.5), 1230.0),
}


def somersault_scene(
    preset: SomersaultPreset = "paper",
    *,
    target: Target = "skin",
    style: PictureStyle = "exact",
    seed: int = 0,
    clutter: int = 14,
) -> Scene:
    """Return a half-twisting somersault seen by three cameras, front, side and top, 768 x 576.

    "paper": 11 poses of one shape, one colour a segment, as paper B has it; "moving-arms": 50 frames/s, with the arm
    movements that cause the twist; "pike": hips, knees and trunk too. The rendered body is a smooth skin or the
    tracker's own ellipsoids. "exact" images are rendered in the tracker's light, on black; those of the "gym" are as
    cameras in a hall record them. The seed varies the start, the noise, the lamps and the background, where `clutter`
    boxes stand along either wall.
    Raises TrialError for an unknown choice. Source: paper B, "Method".
    """
    for value, choices, name in (
        (preset, SomersaultPreset, "preset"),
        (target, Target, "target"),
        (style, PictureStyle, "style"),
    ):
        if value not in get_args(choices):
            raise TrialError(f"{name} '{value}' is not known; choose {' or '.join(get_args(choices))}")
    model = human18(STATURE_M, MASS_KG)
    skill = replace(half_twist(model, has_pike=preset == "pike"), is_rigid=preset == "paper")
    if preset == "paper":
        model = _in_flat_colours(model)
    duration = Fraction(round(1000 * skill.duration_s), 1000)
    rate = (N_POSES - 1) / duration if preset == "paper" else Fraction(50)
    scene = Scene(
        name=f"half-twisting somersault, {preset}, {target}, {style}",
        seed=seed,
        rig=Rig(
            tuple(
                camera_looking_at(name, position, target_m, focal_px=focal_px, size=PICTURE_SIZE)
                for name, (position, target_m, focal_px) in _CAMERAS.items()
            )
        ),
        body=skin_of(model) if target == "skin" else model,
        flight=skill,
        surroundings=None,
        lights=LIGHTS,
        tracking_body=model,
        n_pictures=int(duration * rate) + 1,
        rate=rate,
        is_interlaced=False,
        is_surveyed=False,
        noise_sd=0.0,
        start_joint_error_rad=0.0 if preset == "paper" else float(np.radians(3.0)),
    )
    if style == "exact":
        return scene
    rng = np.random.default_rng([seed, 1])
    hall = _hall(rng, clutter)
    return replace(
        scene,
        lights=None,
        surroundings=hall,
        spots=hall_spots(rng),
        ambient=HALL_AMBIENT,
        noise_sd=4.0,
        exposure_s=0.001,
    )


@lru_cache(maxsize=8)
def _in_flat_colours(model: BodyModel) -> BodyModel:
    return with_flat_colours(model)


def _hall(rng: np.random.Generator, clutter: int) -> BodyModel:
    """Furnish a hall with boxes along the back wall, which the front camera sees, and along the left one."""
    hall = gym(rng, clutter=clutter)
    aside = Rotation.from_euler("z", 90, degrees=True)
    more = [part for part in gym(rng, clutter=clutter).parts if part.name.startswith("box_")]
    parts = [
        replace(
            part,
            name=f"side_{part.name}",
            segment_from_part=RigidTransform.from_rotation(aside) * part.segment_from_part,
        )
        for part in more
    ]
    return replace(hall, segments=(replace(hall.segments[0], parts=(*hall.parts, *parts)),))
