"""What choices make of the block-jump paper's method: `python benchmarks/accuracy/filter_variants.py`.

`block-jump` as the paper has it, and with one choice changed at a time, on six of the sequences of `airborne reproduce
blockjump`, torsos tracked, two seeds. Every variant sees the same rendered frames.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.evaluation.success import success_cover
from airborne.reproduction.block.occlusion import FULLY_OCCLUDED, occlusion_shares
from airborne.reproduction.block.plan import FULL, PAPER_PARTS
from airborne.reproduction.block.tracking import SharedTorsos, hand_set_starts, true_motion
from airborne.synthetic import block_frames
from airborne.tracking.particle import LegsSettings, legs_tracker, torso_tracker

SEQUENCES, SEEDS = (3, 6, 9, 15, 18, 20), range(2)
VARIANTS: dict[str, dict[str, Any]] = {
    "as in the paper": {},
    'swing = "consistent"': {"swing": "consistent"},
    'estimate = "mean"': {"estimate": "mean"},
    'views = "visible"': {"views": "visible"},
    'views = "robust"': {"views": "robust"},
    "tempered": {"tempered": True},
    "torso_shift": {"torso_shift": True},
    'resample_when = "ess"': {"resample_when": "ess"},
    "mean, visible, tempered, torso_shift": {
        "estimate": "mean", "views": "visible", "tempered": True, "torso_shift": True
    },
}  # fmt: skip


def main() -> None:
    """Track, reduce, append the rows."""
    found: dict[str, list] = {name: [] for name in VARIANTS}
    for take in FULL.takes():
        if take.number not in SEQUENCES:
            continue
        scene = take.scene()
        truth, visible = true_motion(scene), occlusion_shares(scene) < FULLY_OCCLUDED
        at = [truth.joints.index(name) for name in PAPER_PARTS]
        for seed in SEEDS:
            starts, shared = hand_set_starts(scene, seed), SharedTorsos([])
            torsos = torso_tracker(scene.calibrated_rig, starts, seed)
            trackers = {
                name: legs_tracker(LegsSettings(seed=seed, **each), scene.calibrated_rig, starts, shared)
                for name, each in VARIANTS.items()
            }
            of_torsos, states = torsos.init(), {name: tracker.init() for name, tracker in trackers.items()}
            points: dict[str, list] = {name: [] for name in VARIANTS}
            for frames in block_frames(scene):
                of_torsos, positions = torsos.step(of_torsos, frames)
                shared.positions.append(positions)
                for name, tracker in trackers.items():
                    states[name], estimates = tracker.step(states[name], frames)
                    points[name].append([each.points for each in estimates])
            for name, each in points.items():
                for i in range(len(scene.blockers)):
                    place, true = np.array(each)[:, i], truth.points[:, i, at]
                    cover = success_cover(scene.calibrated_rig, place, true, PAPER_PARTS, visible=visible[:, i])
                    found[name].append((cover, np.linalg.norm(place - true, axis=-1)))
        print(f"sequence {take.number} done", flush=True)
    rows = []
    for name, pairs in found.items():
        base = {"data": f"{len(SEQUENCES)} sequences, {len(SEEDS)} seeds", "method": name, "n": len(pairs)}
        for part, names in (("hips", PAPER_PARTS[:2]), ("knees", PAPER_PARTS[2:4]), ("feet", PAPER_PARTS[4:])):
            n = sum(cover.n[each] for cover, _ in pairs for each in names)
            for metric, rate in (("success", "rate"), ("touching", "touching_rate")):
                hits = sum(getattr(cover, rate)[each] * cover.n[each] for cover, _ in pairs for each in names)
                rows.append({**base, "metric": f"{part}, {metric}", "unit": "%", "value": 100 * hits / n})
        error = 1e3 * float(np.concatenate([off for _, off in pairs]).mean())
        rows.append({**base, "metric": "joints of the legs, mean 3D error", "unit": "mm", "value": error})
    append("filter_variants", rows)


if __name__ == "__main__":
    main()
