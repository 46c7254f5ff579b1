"""Paper B's synthetic experiment: a half-twisting somersault of 11 poses, tracked by its own method and by better ones.

Readings where the paper is silent: a loop sets somersault, tilt and twist before the vertical, forward and sideways
position; a search starts toward the lower neighbour; every pixel of the three masks has equal weight; each segment has
one flat colour, and the hue runs once around the body.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.body.skin import skin_of
from airborne.errors import ResultError
from airborne.geometry.rotations import angles_from_matrix, wrap
from airborne.rendering import RULES, Lights
from airborne.synthetic import Scene, somersault_scene
from airborne.synthetic.flight.somersault import Target
from airborne.synthetic.throw.exact import exact_frames
from airborne.synthetic.throw.measurements import start_pose
from airborne.tracking import predictors
from airborne.tracking.direct_search.trackers import DirectTracker, simplex_search, stepping_search
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import Tracker, step
from airborne.types import Array
from airborne.video import Frames

RigidMethod = Literal["faithful", "v_sym", "simplex", "refined"]

VARIABLES = ("vertical", "forward", "sideways", "somersault", "tilt", "twist")  # paper B, table 1
VARIABLE_UNITS = ("mm", "mm", "mm", "deg", "deg", "deg")
RIGID_METHODS: tuple[RigidMethod, ...] = ("faithful", "v_sym", "simplex", "refined")
PAPER_RMS = (4.8, 4.5, 1.7, 0.2, 0.3, 0.3)  # paper B, table 1 [mm, deg]
PAPER_LARGEST = (8.0, 8.0, 3.0, 0.4, 0.7, 0.6)  # likewise
_LOOPS = tuple((mm / 1e3, float(np.radians(deg))) for mm, deg in ((50, 5), (30, 3), (20, 2), (10, 1), (10, 1)))
_ORDER = (3, 4, 5, 2, 1, 0)  # of x, y, z, somersault, tilt, twist in a loop
_SIMPLEX = np.repeat((0.15, 0.5), 3)  # about the difference of successive poses [m], [rad]
_AXES = (2, 1, 0)  # vertical, forward, sideways


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """A rendered scene, and the truth."""

    scene: Scene
    frames: tuple[Frames, ...]
    poses: tuple[Pose, ...]  # true
    start: Pose  # as if set by hand

    @property
    def model(self) -> BodyModel:
        """The body of ellipsoids that is tracked with."""
        return self.scene.model

    @property
    def lights(self) -> Lights:
        """The lights in which the images were rendered."""
        assert self.scene.lights is not None
        return self.scene.lights


@dataclass(frozen=True, slots=True, eq=False)
class RunErrors:
    """Estimate minus truth of a run: (n, 6) in the order of `VARIABLES` [mm, deg]; NaN where the body was lost."""

    values: Array

    @property
    def rms(self) -> Array:
        """Root mean square over the tracked poses: (6,) [mm, deg]; NaN where there is none."""
        return np.sqrt(np.mean(self._valid**2, axis=0)) if len(self._valid) else np.full(6, np.nan)

    @property
    def largest(self) -> Array:
        """Largest over the tracked poses: (6,) [mm, deg]; NaN where there is none."""
        return np.abs(self._valid).max(axis=0) if len(self._valid) else np.full(6, np.nan)

    @property
    def n_lost(self) -> int:
        """Poses without an estimate, or more than 90 degrees or 500 mm off."""
        with np.errstate(invalid="ignore"):
            is_near = (np.abs(self.values) < np.repeat((500.0, 90.0), 3)).all(axis=1)
        return int(np.count_nonzero(~is_near))

    @property
    def _valid(self) -> Array:
        return self.values[np.isfinite(self.values).all(axis=1)]


def make_experiment(
    target: Target = "skin", *, person: int = 0, n_poses: int | None = None, noise: float = 0.0
) -> Experiment:
    """Render the somersault: `person` is the seed of the skin's own shape, `noise` the images' [grey levels].

    With `n_poses`, only the first ones. Raises ResultError if it is below 1.
    """
    if n_poses is not None and n_poses < 1:
        raise ResultError(f"n_poses is {n_poses}; expected at least 1")
    scene = somersault_scene("paper", target="ellipsoids", style="exact")
    body = skin_of(scene.model, seed=person) if target == "skin" else scene.model
    n_pictures = scene.n_pictures if n_poses is None else min(n_poses, scene.n_pictures)
    scene = replace(scene, body=body, tracking_body=scene.model, noise_sd=noise, n_pictures=n_pictures)
    flight = scene.flight(np.array([float(scene.time_s(i)) for i in range(scene.n_recorded)]))
    assert scene.lights is not None
    return Experiment(
        scene,
        tuple(exact_frames(scene, scene.lights)),
        tuple(flight.pose(i) for i in range(scene.n_recorded)),
        start_pose(scene),
    )


def track_experiment(
    experiment: Experiment,
    method: RigidMethod,
    *,
    model: BodyModel | None = None,
    lights: Lights | None = None,
    frames: Iterable[Frames] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[RunErrors, list[Pose | None]]:
    """Track the poses in turn, each from the last one, and compare with the truth.

    Body, lights and frames (with other cameras) may differ from those of the rendering. Progress is called after every
    pose.
    """
    tracker = tracker_for(method, model or experiment.model, experiment.start, lights or experiment.lights)
    state, poses, errors = tracker.init(), [], []
    for frame, true in zip(experiment.frames if frames is None else frames, experiment.poses, strict=True):
        state, estimate = step(tracker, state, frame)
        poses.append(estimate.pose)
        errors.append(np.full(6, np.nan) if estimate.pose is None else _difference(estimate.pose, true))
        progress()
    return RunErrors(np.array(errors)), poses


def tracker_for(method: RigidMethod, model: BodyModel, start: Pose, lights: Lights) -> Tracker:
    """Make the tracker of a column of the table."""
    if method == "refined":
        settings = Settings(method="refined", prediction="none", lights=lights, is_light_exact=True, fixed_shape=True)
        return tracker_of(settings, model, start)
    loops = [np.repeat(steps, 3) for steps in _LOOPS]
    search = {
        "faithful": lambda: stepping_search(loops, "v_literal", _ORDER),
        "v_sym": lambda: stepping_search(loops, "v_sym", _ORDER),
        "simplex": lambda: simplex_search(_SIMPLEX),
    }[method]()
    return DirectTracker(
        model,
        start,
        search,
        rule=RULES["raw"],
        lights=lights,
        scale=1,
        predict=predictors.constant,
        notices_loss=False,
    )


def root_vector(pose: Pose) -> Array:
    """Return x, y, z [m], somersault, tilt, twist [rad] of the root: (6,)."""
    root = pose.world_from_root
    return np.concatenate([root.translation, angles_from_matrix(root.rotation.as_matrix())])


def _difference(estimate: Pose, true: Pose) -> Array:
    difference = root_vector(estimate) - root_vector(true)
    return np.concatenate([1e3 * difference[list(_AXES)], np.degrees(wrap(difference[3:]))])
