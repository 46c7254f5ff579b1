"""Scenes: everything that a synthetic recording depends on, as one value."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, Protocol, get_args

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Part, Segment
from airborne.cameras import Rig, camera_looking_at
from airborne.errors import TrialError
from airborne.rendering import Lights
from airborne.synthetic.flight.rigid import Launch, SampledFlight, fly, mass_properties
from airborne.synthetic.throw.light import NO_AMBIENT, Ambient, Spot
from airborne.synthetic.throw.surroundings import gym
from airborne.types import Array

ThrowPreset = Literal["side-somersault", "half-twist"]

_PINE_KG_M3 = 500.0  # density of pine wood, about
YELLOW = np.array([231.0, 200.0, 48.0])  # sRGB
PICTURE_SIZE = (768, 576)  # [px]
_CAMERAS = {  # position, target [m], focal length [px]
    "left": ((-2.35, -5.0, 1.52), (0.02, 0.0, 1.55), 1060.0),
    "right": ((2.30, -4.95, 1.47), (-0.03, 0.02, 1.57), 1095.0),
    "above": ((0.03, -0.95, 6.1), (0.0, -0.02, 1.5), 1040.0),
}
_FACING = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # world from root: long bar up, broad side to y < 0
HALL_AMBIENT = Ambient(np.array([0.16, 0.165, 0.18]), np.array([0.10, 0.085, 0.07]))


class FlightModel(Protocol):
    """The true motion of a body in flight."""

    def __call__(self, time_s: Array) -> SampledFlight:
        """Return the motion at the times (n,) [s]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Throw:
    """The flight of a rigid body of boxes, of one density."""

    body: BodyModel
    density_kg_m3: float
    launch: Launch

    def __call__(self, time_s: Array) -> SampledFlight:
        """Return the motion at the times (n,) [s]."""
        return fly(mass_properties(self.body, self.density_kg_m3), self.launch, time_s)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A body in flight before a static background, and how it is recorded and measured.

    With `lights`, images are exact: every pixel's centre in the tracker's own light, without blur or exposure (paper
    B, "Method"); `spots` and `ambient` are then ignored. Without, they are as a camera in a hall records them.
    """

    name: str
    seed: int  # of all random numbers
    rig: Rig  # cameras without distortion
    body: BodyModel  # as rendered
    flight: FlightModel  # the true motion at given times
    surroundings: BodyModel | None  # static, in world coordinates; the body flies before them; None: black
    spots: tuple[Spot, ...] = ()
    ambient: Ambient = NO_AMBIENT
    lights: Lights | None = None
    tracking_body: BodyModel | None = None  # the trial's body file, which also casts the shadow; None: `body`
    n_pictures: int  # per camera, covered by the truth: fields where interlaced
    rate: Fraction  # images per camera [1/s]
    is_interlaced: bool  # images are fields, the top one first
    is_surveyed: bool = True  # calibrated from control points; else the trial uses the exact cameras
    time_offsets_s: tuple[float, ...] = ()  # true minus nominal time of each camera's images; (): all zero
    exposure_s: float = 0.002  # centred on the image's time
    blur_px: float = 0.5  # sd of the lens blur
    noise_sd: float = 6.0  # of the sensor [grey levels]
    click_sd_px: float = 0.5  # of the control points, in each picture
    digitising_sd_px: float = 1.2  # of the body's points
    start_error_m: float = 0.025  # length of the hand-set start's offset
    start_error_rad: float = np.radians(3.0)
    start_joint_error_rad: float = 0.0  # of every joint

    @property
    def model(self) -> BodyModel:
        """The body of the trial."""
        return self.tracking_body or self.body

    @property
    def n_recorded(self) -> int:
        """The number of images that each camera records: whole frames, where a frame has two fields."""
        return self.n_pictures + (self.n_pictures % 2 if self.is_interlaced else 0)

    def time_s(self, index: int) -> Fraction:
        """Return the exact time of an image [s]."""
        return index / self.rate

    def parity(self, index: int) -> int:
        """Return which rows of the frame a field holds: 0 those from the top row on, 1 the others."""
        return index % 2


def cross_scene(preset: ThrowPreset = "half-twist", *, seed: int = 0, clutter: int = 14) -> Scene:
    """Return paper B's video experiment: a yellow wooden cross thrown before three cameras, 50 fields/s, 768 x 576.

    "side-somersault": 39 fields, rotating in the plane of its bars; "half-twist": 34 fields, rotating about its short
    bar, which is unstable and turns over. The seed varies the throw, the lamps and the background; `clutter` is the
    number of boxes in it. Raises TrialError for an unknown preset. Source: paper B, "Method".
    """
    if preset not in get_args(ThrowPreset):
        raise TrialError(f"preset '{preset}' is not known; choose {' or '.join(get_args(ThrowPreset))}")
    rng = np.random.default_rng([seed, 1])
    is_side = preset == "side-somersault"
    turn = Rotation.from_rotvec(rng.normal(0, 0.08, 3)).as_matrix()
    launch = Launch(
        centre=np.array([-0.38, 0.0, 1.25]) + rng.normal(0, 0.02, 3),
        velocity=np.array([0.95, 0.08, 3.65 if is_side else 3.2]) + rng.normal(0, 0.04, 3),
        R=turn @ _FACING,
        angular_velocity=np.array([0.5, 0.35, -8.2] if is_side else [10.0, 3.0, 0.3]) + rng.normal(0, 0.1, 3),
    )
    body = _cross()
    return Scene(
        name=f"thrown cross, {'side' if is_side else 'half-twisting'} somersault",
        seed=seed,
        rig=Rig(
            tuple(
                camera_looking_at(f"cam{i}", position, target, focal_px=focal_px, size=PICTURE_SIZE)
                for i, (position, target, focal_px) in enumerate(_CAMERAS.values(), start=1)
            )
        ),
        body=body,
        flight=Throw(body, _PINE_KG_M3, launch),
        surroundings=gym(rng, clutter=clutter),
        spots=hall_spots(rng),
        ambient=HALL_AMBIENT,
        n_pictures=39 if is_side else 34,
        rate=Fraction(50),
        is_interlaced=True,
    )


def _cross() -> BodyModel:
    bars = (("long_bar", (0.06, 0.9, 0.045), (0.0, 0.0, 0.0)), ("short_bar", (0.6, 0.06, 0.045), (0.0, 0.18, 0.0)))
    parts = tuple(
        Part(name, Box(np.array(size)), RigidTransform.from_components(centre, Rotation.identity()), YELLOW)
        for name, size, centre in bars
    )
    return BodyModel("wooden cross", (Segment("cross", None, np.zeros(3), parts),))


def hall_spots(rng: np.random.Generator) -> tuple[Spot, ...]:
    """Return two spot lights, left and right in front of the flight, at random positions."""
    positions = np.array([[-3.0, -3.2, 3.7], [3.2, -2.5, 3.9]]) + rng.normal(0, 0.15, (2, 3))
    targets = np.array([[-0.2, 0.3, 1.3], [0.3, 0.2, 1.5]]) + rng.normal(0, 0.1, (2, 3))
    light = np.array([[1.0, 0.97, 0.9], [0.96, 0.97, 1.0]]) * rng.uniform([[19.5], [16.0]], [[22.5], [19.0]])
    return tuple(
        Spot(position=position, target=target, light_at_1m=power, cone_rad=np.radians(32.0))
        for position, target, power in zip(positions, targets, light, strict=True)
    )
