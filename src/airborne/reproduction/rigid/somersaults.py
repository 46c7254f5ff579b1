"""Paper B's synthetic experiment: a half-twisting somersault of 11 poses, tracked by its own method and by better ones.

Readings where the paper is silent: a loop sets somersault, tilt and twist before the vertical, forward and sideways
position; a search sets out toward the lower neighbour; every pixel of the three masks counts alike; each segment has
one flat colour, and the hue goes once round the body.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.skin import skin_of
from airborne.errors import ResultError
from airborne.geometry.rotations import angles_from_matrix, wrapped
from airborne.rendering import RULES, Lights
from airborne.synthetic import Scene, somersault
from airborne.synthetic.flight.somersault import Target
from airborne.synthetic.throw.exact import exact_frames
from airborne.synthetic.throw.measurements import start_pose
from airborne.tracking import predictors
from airborne.tracking.direct_search.trackers import Direct, simplex_search, stepping_search
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import Tracker, step
from airborne.video import Frames

Array = NDArray[np.floating]
MethodName = Literal["faithful", "v_sym", "simplex", "refined"]

VARIABLES = ("vertical", "forward", "sideways", "somersault", "tilt", "twist")  # paper B, table 1
UNITS = ("mm", "mm", "mm", "deg", "deg", "deg")
METHODS: tuple[MethodName, ...] = ("faithful", "v_sym", "simplex", "refined")
PAPER_RMS = (4.8, 4.5, 1.7, 0.2, 0.3, 0.3)  # paper B, table 1 [mm, deg]
PAPER_LARGEST = (8.0, 8.0, 3.0, 0.4, 0.7, 0.6)
LOOPS = tuple((mm / 1e3, float(np.radians(deg))) for mm, deg in ((50, 5), (30, 3), (20, 2), (10, 1), (10, 1)))
ORDER = (3, 4, 5, 2, 1, 0)  # of x, y, z, somersault, tilt, twist in a loop
_SIMPLEX = np.repeat((0.15, 0.5), 3)  # about what lies between two poses [m], [rad]
_AXES = (2, 1, 0)  # vertical, forward, sideways


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """A scene drawn, and the truth."""

    scene: Scene
    frames: tuple[Frames, ...]
    poses: tuple[Pose, ...]  # true
    start: Pose  # as if set by hand

    @property
    def model(self) -> BodyModel:
        """The ellipsoids that track."""
        return self.scene.model

    @property
    def lights(self) -> Lights:
        """The lights that the pictures were drawn in."""
        assert self.scene.lights is not None
        return self.scene.lights


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Estimate minus truth of a run: (n, 6) in the order of `VARIABLES` [mm, deg]; NaN where the body was lost."""

    values: Array

    @property
    def rms(self) -> Array:
        """Root mean square over the poses found: (6,) [mm, deg]; NaN where there is none."""
        return np.sqrt(np.mean(self._found**2, axis=0)) if len(self._found) else np.full(6, np.nan)

    @property
    def largest(self) -> Array:
        """Largest over the poses found: (6,) [mm, deg]; NaN where there is none."""
        return np.abs(self._found).max(axis=0) if len(self._found) else np.full(6, np.nan)

    @property
    def n_lost(self) -> int:
        """Poses without an estimate, or more than 90 degrees or 500 mm off."""
        with np.errstate(invalid="ignore"):
            is_near = (np.abs(self.values) < np.repeat((500.0, 90.0), 3)).all(axis=1)
        return int(np.count_nonzero(~is_near))

    @property
    def _found(self) -> Array:
        return self.values[np.isfinite(self.values).all(axis=1)]


def experiment(
    target: Target = "skin", *, person: int = 0, n_poses: int | None = None, noise: float = 0.0
) -> Experiment:
    """Draw the somersault: `person` is the seed of the skin's own shape, `noise` the pictures' [grey levels].

    With `n_poses`, only the first ones. Raises ResultError for less than one.
    """
    if n_poses is not None and n_poses < 1:
        raise ResultError(f"n_poses is {n_poses}; expected at least 1")
    scene = somersault("paper", target="ellipsoids", style="exact")
    body = skin_of(scene.model, seed=person) if target == "skin" else scene.model
    shown = scene.n_pictures if n_poses is None else min(n_poses, scene.n_pictures)
    scene = replace(scene, body=body, tracking_body=scene.model, noise_sd=noise, n_pictures=shown)
    flight = scene.flight(np.array([float(scene.time_s(i)) for i in range(scene.n_shown)]))
    assert scene.lights is not None
    return Experiment(
        scene,
        tuple(exact_frames(scene, scene.lights)),
        tuple(flight.pose(i) for i in range(scene.n_shown)),
        start_pose(scene),
    )


def tracked(
    what: Experiment,
    method: MethodName,
    *,
    model: BodyModel | None = None,
    lights: Lights | None = None,
    frames: Iterable[Frames] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[Errors, list[Pose | None]]:
    """Track the poses in turn, each from the last one, and compare with the truth.

    Body, lights and frames (with other cameras) may be others than those that the pictures were drawn with. Progress
    is called after every pose.
    """
    tracker = tracker_for(method, model or what.model, what.start, lights or what.lights)
    state, found, errors = tracker.init(), [], []
    for frame, true in zip(what.frames if frames is None else frames, what.poses, strict=True):
        state, estimate = step(tracker, state, frame)
        found.append(estimate.pose)
        errors.append(np.full(6, np.nan) if estimate.pose is None else _difference(estimate.pose, true))
        progress()
    return Errors(np.array(errors)), found


def tracker_for(method: MethodName, model: BodyModel, start: Pose, lights: Lights) -> Tracker:
    """Make the tracker of a column of the table."""
    if method == "refined":
        settings = Settings(method="refined", prediction="none", lights=lights, is_light_exact=True, fixed_shape=True)
        return tracker_of(settings, model, start)
    loops = [np.repeat(steps, 3) for steps in LOOPS]
    search = {
        "faithful": lambda: stepping_search(loops, "v_literal", ORDER),
        "v_sym": lambda: stepping_search(loops, "v_sym", ORDER),
        "simplex": lambda: simplex_search(_SIMPLEX),
    }[method]()
    return Direct(
        model, start, search, RULES["raw"], lights, scale=1, predict=predictors.stay, notices_loss=False
    )  # fmt: skip


def vector(pose: Pose) -> Array:
    """Return x, y, z [m], somersault, tilt, twist [rad] of the root: (6,)."""
    place = pose.world_from_root
    return np.concatenate([place.translation, angles_from_matrix(place.rotation.as_matrix())])


def _difference(found: Pose, true: Pose) -> Array:
    change = vector(found) - vector(true)
    return np.concatenate([1e3 * change[list(_AXES)], np.degrees(wrapped(change[3:]))])
