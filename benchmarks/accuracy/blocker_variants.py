"""What each part of `blocker` gains: `python benchmarks/accuracy/blocker_variants.py [SEED ...]`.

Synthetic blocks that were not used while the method was made (seeds 31 to 33 with one blocker, 34 with two), tracked
with everything, and with one part switched off at a time. Every variant sees the same rendered frames.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body.legs import LEG_POINTS
from airborne.synthetic import block_frames, block_scene, noisy_starts, true_joints
from airborne.tracking.capsules import Blocker, bystanders, dynamics, fit, occlusion, surface_colours, tracker
from airborne.tracking.players import PlayerStart

SEEDS, WITH_TWO = (31, 32, 33, 34), (34,)
INSIDE_95 = 7.815  # squared distance that 95 % of a Gaussian in space lie within
Switch = tuple[ModuleType, str, Any]
VARIANTS: dict[str, list[Switch]] = {
    "everything": [],
    "without habits": [(fit, "POSTURE_INFORMATION", np.zeros_like(fit.POSTURE_INFORMATION))],
    "without standing feet": [(tracker, "_CONTACT_M", -1.0)],
    "without flight": [(tracker, "_AIRBORNE_M", np.inf)],
    "without hidden views": [(occlusion, "_OCCLUSION_RATE", 0.0)],
    "clothes that stay": [(dynamics, "_SLIDING_SD", dynamics._SLIDING_SD * 0.01)],
    "colours as lit at first": [(surface_colours, "_LIGHTS", np.ones_like(surface_colours._LIGHTS))],
    "socks and shoes as at first": [(tracker, "COLOUR_UPDATE_S", np.inf)],
    "without other players": [(bystanders, "_NEAR_M", 0.0)],
}


@contextmanager
def switched(switches: list[Switch]) -> Iterator[None]:
    """Switch parts off for a while."""
    kept = [(module, name, getattr(module, name)) for module, name, _ in switches]
    try:
        for module, name, value in switches:
            setattr(module, name, value)
        yield
    finally:
        for module, name, value in kept:
            setattr(module, name, value)


def follow(seed: int, found: dict[str, list[tuple[np.ndarray, np.ndarray]]]) -> None:
    """Track a scene with every variant; add errors (6, 3) [m] and covariances (6, 3, 3) to what was found."""
    scene = block_scene(seed, n_blockers=2 if seed in WITH_TWO else 1)
    truth = {}
    for player in scene.blockers:
        paths = true_joints(player, scene.times_s)
        truth[player.name] = np.stack([paths[name] for name in LEG_POINTS], axis=1)
    starts = [PlayerStart(name=name, joints_m=joints) for name, joints in noisy_starts(scene).items()]
    tracking = Blocker(starts)
    states: dict[str, Any] = {name: tracking.init() for name in VARIANTS}
    for k, frames in enumerate(block_frames(scene)):
        for name, switches in VARIANTS.items():
            with switched(switches):
                states[name], estimates = tracking.step(states[name], frames)
            for each in estimates:
                found[name].append((each.points[:6] - truth[each.player][k], each.covariance[:6]))


def main(seeds: list[int]) -> None:
    """Track, reduce, append the rows."""
    found: dict[str, list] = {name: [] for name in VARIANTS}
    for seed in seeds:
        follow(seed, found)
    rows = []
    for name, pairs in found.items():
        off, covariance = np.array([a for a, _ in pairs]), np.array([c for _, c in pairs])
        error = np.linalg.norm(off, axis=-1) * 1e3
        inside = np.einsum("fji,fji->fj", off, np.linalg.solve(covariance, off[..., None])[..., 0]) < INSIDE_95
        base = {"data": f"synthetic blocks {min(seeds)} to {max(seeds)}", "method": name, "n": len(pairs)}
        rows += [
            {**base, "metric": "joints of the legs, mean 3D error", "unit": "mm", "value": float(np.nanmean(error))},
            {**base, "metric": "farther than 100 mm", "unit": "%", "value": float(np.nanmean(error > 100) * 100)},
            {**base, "metric": "in the 95 % region", "unit": "%", "value": float(np.mean(inside) * 100)},
        ]
    append("blocker_variants", rows)


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or list(SEEDS))
