"""All kernels compiled by use: a thing, a person and players are tracked for a few frames."""

from __future__ import annotations

import multiprocessing
import tempfile
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any

from airborne.body_fitting.first_frames import fit_preset
from airborne.run.players_tracker import compile_kernels
from airborne.run.track import track_trial
from airborne.synthetic import scene_frames, somersault_scene
from airborne.synthetic.throw.measurements import start_pose
from airborne.tracking.methods import Settings, sample_body_colours, tracker_of
from airborne.tracking.model_based.global_search import SearchRange, search_globally
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.tracker import step
from airborne.trial.examples import example_trial
from airborne.trial.file import Trial, read_trial

_N_FRAMES = 4  # the first is found, the second followed, later ones also predicted
_LEG_POINTS = {"hip": 0.9, "knee": 0.5, "ankle": 0.1}  # heights of a player's joints [m]
_AT_M = {"left": -0.12, "right": 0.12}  # where the sides are


def warm_kernels() -> None:
    """Compile all kernels that tracking uses and leave them in the cache; two processes share the work."""
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as processes:
        for each in [processes.submit(_track_bodies), processes.submit(_track_players)]:
            each.result()


def _track_bodies() -> None:
    """Track the bundled example from its trial file, and a synthetic somersault, images in memory."""
    trial = read_trial(example_trial("thrown_cross"), {"stop": _N_FRAMES})
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
    search_globally(RenderModel.of(model), [start_pose(scene)], frames[0], state.inner.appearance, search_range=nearby)


def _track_players() -> None:
    """Take the steps of players' trackers on empty images."""
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
