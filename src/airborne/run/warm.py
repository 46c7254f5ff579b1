"""All kernels compiled by use: a thing, a person and players are tracked for a few frames, and a path is smoothed."""

from __future__ import annotations

import multiprocessing
import tempfile
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any

import av
import numpy as np

from airborne.appearance import BackgroundModel, count_colours, light_planes
from airborne.appearance.background import TILE_PX
from airborne.appearance.brightness import brightness_ratios
from airborne.appearance.lighting import LIGHT_FROM_SRGB
from airborne.appearance.surface_classes import class_evidence
from airborne.body import Pose
from airborne.body_fitting.first_frames import fit_preset
from airborne.cameras import camera_looking_at
from airborne.motion.smoothing.kalman import kalman_smoother
from airborne.motion.smoothing.segments import MIN_FRAMES
from airborne.rendering import evidence_maps
from airborne.run.players_tracker import compile_kernels
from airborne.run.track import track_trial
from airborne.synthetic import scene_frames, somersault_scene
from airborne.synthetic.throw.measurements import start_pose
from airborne.tracking.capsules.floor_search import evaluate_grid
from airborne.tracking.capsules.jumper import SURFACE_CLASSES
from airborne.tracking.capsules.standing import ColourViews
from airborne.tracking.methods import Settings, sample_body_colours, tracker_of
from airborne.tracking.model_based.degrees_of_freedom import limbs_of
from airborne.tracking.model_based.global_search import SearchRange, search_globally
from airborne.tracking.model_based.misplaced_limbs import search_limb
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.tracker import step
from airborne.trial.examples import example_trial
from airborne.trial.file import Trial, read_trial
from airborne.video import Frames, View
from airborne.video.crops import conversion_of

_N_FRAMES = 4  # the first is found, the second followed, later ones also predicted
_N_FIELDS = 12  # of the example: enough to uncover what is behind the body, which the self-check looks at
_SIZE = (64, 48)  # chosen: of the image of which a part is converted [px]
_LEG_POINTS = {"hip": 0.9, "knee": 0.5, "ankle": 0.1}  # heights of a player's joints [m]
_AT_M = {"left": -0.12, "right": 0.12}  # where the sides are


def warm_kernels() -> None:
    """Compile all kernels that tracking and smoothing use and leave them in the cache; two processes share the work."""
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as processes:
        for each in [processes.submit(_track_bodies), processes.submit(_track_others)]:
            each.result()


def _track_bodies() -> None:
    """Track the bundled example from its trial file, and a synthetic somersault, images in memory."""
    trial = read_trial(example_trial("thrown_cross"), {"stop": _N_FIELDS})
    with tempfile.TemporaryDirectory() as folder:
        track_trial(trial, Path(folder), pictures=False)
    scene = somersault_scene("moving-arms", target="ellipsoids")
    frames = list(islice(scene_frames(scene), _N_FRAMES))
    model = sample_body_colours(scene.model, start_pose(scene), frames[0])
    fit_preset(model, [(frames[0], start_pose(scene))], mass_kg=None)
    tracker = tracker_of(Settings(), model, start_pose(scene))
    state: Any = tracker.init()
    for each in frames:
        state, _ = step(tracker, state, each)
    nearby = SearchRange.after(gap_s=0.0)
    render_model = RenderModel.of(model)
    search_globally(render_model, [start_pose(scene)], frames[0], state.inner.appearance, search_range=nearby)
    _search_for_a_limb(render_model, start_pose(scene), frames[0])


def _search_for_a_limb(render_model: RenderModel, pose: Pose, frames: Frames) -> None:
    """Search for one limb where the images tell nothing."""
    cameras = [view.camera for view in frames.views if view is not None]
    maps = evidence_maps(cameras, [np.zeros(camera.size[::-1], np.float32) for camera in cameras])
    search_limb(render_model, [pose], limbs_of(render_model.model)[0], maps, shared=1.0)


def read_images() -> None:
    """Read whole images and parts of them, which kernels take as other types: where a body will be decides on it."""
    conversion_of(av.VideoFrame(*_SIZE, "yuv420p"), short_side=min(_SIZE))
    for kind in (np.uint8, np.float32):
        image = np.zeros((2, 4, 3), kind)
        for part in (image, image[:, 1:3]):
            light_planes(part, LIGHT_FROM_SRGB, np.empty((3, *part.shape[:2]), np.float32))
    image, colours = np.zeros((2, 4, 3), np.uint8), np.zeros((32, 32, 32), np.float32)
    table, classes = np.zeros((colours.size, len(SURFACE_CLASSES)), np.float32), len(SURFACE_CLASSES)
    for part in (image, image[:, 1:3]):
        count_colours(part, np.zeros(part.shape[:2], np.bool_), 1, colours)
        class_evidence(part, table, 1, np.empty((classes, *part.shape[:2]), np.float32))
    image = np.zeros((2 * TILE_PX, 3 * TILE_PX, 3), np.uint8)
    known = BackgroundModel().learn(image, np.zeros(image.shape[:2], np.bool_), (0, 0))
    for part in (image, image[:8], image[:TILE_PX, :TILE_PX].copy(), image[:8, :8].copy()):
        for corner in ((0, 0), (1, 1)):
            brightness_ratios(part, known, corner)
            brightness_ratios(part, BackgroundModel(), corner)


def _look_for_players() -> None:
    """Look for players, as for those whom no start names, where the images tell nothing."""
    camera = camera_looking_at("front", np.array([0, -8, 2.0]), np.array([0, 0, 1.0]), focal_px=60.0, size=_SIZE)
    grey = View(camera, np.full((*_SIZE[::-1], 3), 128, np.uint8))
    views = ColourViews.of([grey], np.array([[-1.0, -1.0], [1.0, 1.0]]))
    evaluate_grid(views, np.zeros((1, 2)))


def smooth_a_path() -> None:
    """Smooth a path at rest, by the smoother that `airborne smooth` takes if no other is asked for."""
    time_s, covariance = np.arange(MIN_FRAMES) / 60, np.tile(1e-6 * np.eye(3), (MIN_FRAMES, 1, 1))
    kalman_smoother(time_s, np.zeros((MIN_FRAMES, 3)), covariance)


def _track_others() -> None:
    """Take the steps of players' trackers on empty images, then what no tracker does in its first frames."""
    joints = {"torso": (0.0, 0.0, 1.1)}
    joints |= {f"{joint}_{side}": (x, 0.0, z) for joint, z in _LEG_POINTS.items() for side, x in _AT_M.items()}
    tables = {
        "name": "players",
        "camera": [{"name": name, "video": f"{name}.mp4"} for name in ("left", "right")],
        "calibration": {"file": "calib.toml"},
        "body": {"preset": "legs"},
        "start": {"player": [{"name": "player", "joints_m": joints}]},
    }
    compile_kernels(Trial(**tables))
    read_images()
    _look_for_players()
    smooth_a_path()
