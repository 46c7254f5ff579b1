"""Measure what a key is worth, forward alone and in both directions: `python benchmarks/accuracy/keys.py [FOLDER]`.

Six synthetic people whose limbs swing fast, with a key in the last of 16 frames (about 4 minutes); and, given the
folder of somersault_2, that recording with a key at frame 55 (about 4 minutes more). A key's joints are clicked in
every view: the true ones projected, with an error of half a pixel of small images, of one pixel of the recording.
The tracker sees no truth. `--seeds 11-14` takes other people, and writes no rows.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rows import append

from airborne.body import Pose
from airborne.body.chain import clamp_to_limits
from airborne.run.opening import open_cameras
from airborne.run.track import track_trial
from airborne.tracking import Estimate, Status
from airborne.tracking.both_directions import track_between_keys
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import track_frames
from airborne.trial.file import Trial, read_trial
from airborne.trial.keys import KeyTable
from tests.support.people import CAMERAS, HELD, HUMAN, PLACE, landmark_errors_mm, person, wrong
from tests.support.scenes import Scene, clutter

_SEEDS, _N, _SPEED, _CAMERAS = range(30, 36), 16, 8.0, 3
_LANDMARKS = [landmark.name for landmark in HUMAN.landmarks]
_CLICKED = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
_BAD_MM, _KEY, _RATE = 80.0, 55, 60
_FLOOR_MM = 50  # of the left wrist of somersault_2, in both directions


class _Reader:
    """The frames of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def forward(self, start: int, stop: int | None):
        return (self.scene.frames(i) for i in range(start, _N if stop is None else stop))

    def backward(self, start: int, stop: int):
        return (self.scene.frames(i) for i in reversed(range(start, stop)))


def scene_of(seed: int) -> Scene:
    """Return a person who turns, and swings arms and legs."""
    rng = np.random.default_rng(seed)
    half = HUMAN.limits.half_rad
    reach = np.where(np.isfinite(half), np.minimum(half, 1.4), 1.0) * rng.uniform(0.2, 0.9, half.shape)
    is_limb = [any(word in each.name for word in ("arm", "thigh", "shank")) for each in HUMAN.segments[1:]]
    reach = np.where(np.array(is_limb)[:, None], reach, 0.2 * reach)
    phase, rate = rng.uniform(0, 2 * np.pi, half.shape), _SPEED * rng.uniform(0.5, 1.3, half.shape)
    first, turn, velocity = Rotation.random(random_state=seed), rng.normal(0, 2.0, 3), rng.normal(0, 0.4, 3)

    def motion(time_s) -> Pose:
        t = float(time_s)
        root = RigidTransform.from_components(PLACE + velocity * (t - 0.3), Rotation.from_rotvec(turn * t) * first)
        angles = 0.3 * HELD + reach * np.sin(rate * t + phase)
        return clamp_to_limits(HUMAN, Pose(world_from_root=root, joint_angles=angles))

    walls = tuple(clutter(10 * seed + i) for i in range(4))
    return replace(person(motion, cameras=CAMERAS[:_CAMERAS]), backgrounds=walls)


def clicks_of(scene: Scene, frame: int) -> PoseEvidence:
    """Return the joints clicked in every view."""
    rng, points = np.random.default_rng(frame), HUMAN.with_pose(scene.start(frame)).landmarks
    rows = [(i, c) for i, name in enumerate(_LANDMARKS) if name.split("_")[0] in _CLICKED for c in scene.cameras]
    return PoseEvidence(
        model=HUMAN,
        clicked=np.array([i for i, _ in rows]),
        P=np.stack([camera.P for _, camera in rows]),
        px=np.stack([camera.px_from_world(points[i]) + rng.normal(0, 0.5, 2) for i, camera in rows]),
        px_sds=np.ones(len(rows)),
    )


def measure_people(seeds: range) -> list[dict]:
    """Track people with a key in the last frame; errors are those of the frames before it."""
    key, found = _N - 1, {"forward": [], "both": []}
    for seed in seeds:
        scene = scene_of(seed)
        tracker = tracker_of(Settings(), HUMAN, wrong(scene.start(), seed=seed), {key: clicks_of(scene, key)})
        forward = track_frames(tracker, (scene.frames(i) for i in range(_N)), lambda estimate: None)
        both = track_between_keys(tracker, HUMAN, _Reader(scene), range(_N), keys=[key], write=lambda estimate: None)
        for name, run in (("forward", forward), ("both", both)):
            rows = [(estimate, landmark_errors_mm(scene, estimate)) for _, estimate in run if estimate.pose is not None]
            found[name] += rows[:-1]
            print(f"{seed} {name}: mean {np.mean([error for _, error in rows[:-1]]):.1f} mm", flush=True)
    return [row for name, rows in found.items() for row in _rows(f"{len(seeds)} synthetic people", name, rows)]


def _rows(data: str, method: str, found: list[tuple[Estimate, np.ndarray]]) -> list[dict]:
    errors = np.array([error for _, error in found])
    is_bad = errors.max(axis=1) > _BAD_MM
    is_uncertain = np.array([estimate.status is not Status.TRACKED for estimate, _ in found])
    common = {"data": data, "method": method, "n": len(found)}
    return [
        {**common, "metric": "mean joint error", "unit": "mm", "value": float(errors.mean())},
        {**common, "metric": f"frames with a joint over {_BAD_MM:g} mm off", "unit": "", "value": int(is_bad.sum())},
        {**common, "metric": "of them tracked", "unit": "", "value": int((is_bad & ~is_uncertain).sum())},
        {**common, "metric": "of the others uncertain", "unit": "", "value": int((~is_bad & is_uncertain).sum())},
    ]


def measure_somersault(folder: Path) -> list[dict]:
    """Track somersault_2 with a key; errors of a joint are means over the frames before the key and after it."""
    true: dict[tuple[int, str], np.ndarray] = {}
    with (folder / "truth_joints.csv").open() as file:
        for row in csv.DictReader(file):
            at = np.array([float(row[axis]) for axis in ("x_m", "y_m", "z_m")])
            true[round(float(row["time_s"]) * _RATE), row["joint"]] = at
    trial = read_trial(folder / "trial.toml")
    rig, rng = open_cameras(trial).rig, np.random.default_rng(7)
    clicks = {
        joint: {camera.name: (camera.px_from_world(at) + rng.normal(0, 1, 2)).tolist() for camera in rig}
        for (frame, joint), at in true.items()
        if frame == _KEY
    }
    rows = []
    for directions in ("forward", "both"):
        settings = trial.track.model_copy(update={"directions": directions})
        key = KeyTable(frame=_KEY, sd_px=3.0, points_px=clicks)
        errors = _errors_of(trial.model_copy(update={"track": settings, "key": [key]}), true)
        common = {"data": "somersault_2, one key", "method": directions, "unit": "mm"}
        for name in ("wrist_left", "wrist_right"):
            floor = _FLOOR_MM if directions == "both" and name == "wrist_left" else ""
            value = float(np.mean(errors[name]))
            rows.append({**common, "metric": name, "value": value, "n": len(errors[name]), "floor": floor})
        every = np.concatenate(list(errors.values()))
        rows.append({**common, "metric": "mean joint error", "value": float(every.mean()), "n": len(every)})
    return rows


def _errors_of(trial: Trial, true: dict[tuple[int, str], np.ndarray]) -> dict[str, list[float]]:
    with tempfile.TemporaryDirectory() as results:
        track_trial(trial, Path(results) / "run", pictures=False)
        with (Path(results) / "run" / "joints.csv").open() as file:
            found = [row for row in csv.DictReader(file) if (int(row["frame"]), row["joint"]) in true and row["x_m"]]
    errors: dict[str, list[float]] = {}
    for row in found:
        at = np.array([float(row[axis]) for axis in ("x_m", "y_m", "z_m")])
        errors.setdefault(row["joint"], []).append(
            1e3 * float(np.linalg.norm(at - true[int(row["frame"]), row["joint"]]))
        )
    return errors


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="that of somersault_2")
    parser.add_argument("--seeds", help="first-last, of other people")
    asked = parser.parse_args()
    if asked.seeds:
        first, last = map(int, asked.seeds.split("-"))
        for row in measure_people(range(first, last + 1)):
            print(row)
        return
    append("keys", measure_people(_SEEDS))
    if asked.folder is not None:
        append("keys", measure_somersault(asked.folder))


if __name__ == "__main__":
    main()
