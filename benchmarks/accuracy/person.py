"""Measure the trackers on a synthetic person: `python benchmarks/accuracy/person.py [--gym]` (minutes).

The half-twisting somersault with moving arms: a smooth-skinned person filmed by three cameras at 50 Hz, tracked by the
body of ellipsoids from a start 25 mm and 3 degrees wrong, in every joint too. Drawn on black in known light, the same
with the light unknown, and with `--gym` before a cluttered hall with shadows and noise.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body.chain import move_pose
from airborne.synthetic import scene_frames
from airborne.synthetic.flight.somersault import somersault_scene
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.tracker import step

SEEDS = (0, 1, 2)
START_M, START_RAD = 0.025, np.radians(3.0)


def start_of(truth, seed: int):
    """Return a pose wrong by START_M at the root and START_RAD about every axis of root and joints."""
    rng = np.random.default_rng([seed, 7])
    away = rng.normal(size=3)
    signs = np.sign(rng.normal(size=3 + truth.joint_angles.size))
    return move_pose(truth, np.concatenate([START_M * away / np.linalg.norm(away), START_RAD * signs]))


def measure(name: str, scene, recorded: list, settings: Settings) -> None:
    """Track from several starts and append the rows."""
    model = scene.tracking_body
    flight = scene.flight(np.array([float(scene.time_s(i)) for i in range(len(recorded))]))
    truth = [model.with_pose(flight.pose(i)).landmarks for i in range(len(recorded))]
    errors_mm, settled_mm, first_mm, times, n_lost = [], [], [], [], 0
    for seed in SEEDS:
        tracker = tracker_of(settings, model, start_of(flight.pose(0), seed))
        state, found = tracker.init(), []
        for seen, true in zip(recorded, truth, strict=True):
            begun = time.thread_time()
            state, estimate = step(tracker, state, seen)
            times.append(time.thread_time() - begun)
            if estimate.pose is None:
                n_lost += 1
                continue
            found.append(np.linalg.norm(model.with_pose(estimate.pose).landmarks - true, axis=1).mean() * 1e3)
        errors_mm.append(np.mean(found))
        first_mm.append(found[0])
        settled_mm.append(np.mean(found[5:]))
    base = {"data": name, "method": settings.method, "n": len(SEEDS) * len(recorded)}
    spread = f"{min(errors_mm):.3g}..{max(errors_mm):.3g}"
    append(
        "person",
        [
            {**base, "metric": "mean joint error", "unit": "mm", "value": float(np.mean(errors_mm)), "floor": 15,
             "interval": spread},
            {**base, "metric": "mean joint error, first frame", "unit": "mm", "value": float(np.mean(first_mm))},
            {**base, "metric": "mean joint error, from frame 5", "unit": "mm", "value": float(np.mean(settled_mm))},
            {**base, "metric": "frames lost", "unit": "", "value": n_lost, "floor": "0"},
            {**base, "metric": "CPU per frame, median", "unit": "ms", "value": float(np.median(times)) * 1e3,
             "floor": 150},
        ],
    )  # fmt: skip


def main() -> None:
    """Measure every recording."""
    exact = somersault_scene("moving-arms", target="skin", style="exact")
    drawn = list(scene_frames(exact))
    unknown = Settings(method="refined")
    known = replace(unknown, lights=exact.lights, is_light_exact=True)
    measure("somersault, moving arms, known light", exact, drawn, known)
    for method in ("refined", "joint", "hierarchical"):
        measure("somersault, moving arms, unknown light", exact, drawn, replace(unknown, method=method))
    if "--gym" in sys.argv[1:]:
        gym = somersault_scene("moving-arms", target="skin", style="gym")
        measure("somersault, moving arms, in a hall", gym, list(scene_frames(gym)), unknown)


if __name__ == "__main__":
    main()
