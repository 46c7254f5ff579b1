"""Jumps of noisy joints against synthetic jumps' exact facts: `python benchmarks/accuracy/jumps.py`.

No images: the true joints of eight scenes with noise like the players' trackers' (`motion.free_fall.PLAYER_NOISE`),
in every joint and axis by itself.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body.legs import LEG_POINTS
from airborne.evaluation.jump_errors import EVENTS, HEIGHTS
from airborne.evaluation.players import compare_players
from airborne.evaluation.players_truth import reference_jump
from airborne.motion.free_fall import noise_covariance
from airborne.reproduction.block.tracking import true_motion
from airborne.synthetic import block_scene, jump_truth

SCENES, SEEDS = range(8), range(4)
FEET = ("foot_left", "foot_right")


def main() -> None:
    """Add noise of two sizes, with and without the balls of the feet; append the rows."""
    scenes = [block_scene(seed) for seed in SCENES]
    truths = [true_motion(scene) for scene in scenes]
    for joints in (LEG_POINTS, (*LEG_POINTS, *FEET)):
        for sd_m in (0.01, 0.02):
            found = []
            for number, (scene, truth) in enumerate(zip(scenes, truths, strict=True)):
                jumpers = [player for player in scene.players if player.movement.flight is not None]
                known = {player.name: reference_jump(jump_truth(player, float(scene.rate))) for player in jumpers}
                at = [truth.joints.index(name) for name in joints]
                root = np.linalg.cholesky(noise_covariance(truth.time_s, np.full(len(truth), sd_m**2)))
                for seed in SEEDS:
                    shape = (len(truth), len(truth.players), len(joints), 3)
                    noise = np.random.default_rng((number, seed)).standard_normal(shape)
                    noisy = replace(
                        truth,
                        joints=joints,
                        points=truth.points[:, :, at] + np.einsum("ij,jplk->iplk", root, noise),
                        covariance=np.broadcast_to(sd_m**2 * np.eye(3), (*shape, 3)),
                    )
                    found += compare_players(noisy, truth, reference_jumps=known).jumps
            data = f"{len(SCENES)} scenes, {len(joints)} joints, noise {1e3 * sd_m:.0f} mm"
            report(data, [jump for jump in found if jump.stated_height_error_m])


def report(data: str, jumps: list) -> None:
    """Append mean absolute errors and shares inside the intervals."""
    base = {"data": data, "method": "jumps", "n": len(jumps)}
    rows: list[dict] = [{**base, "metric": "not found", "unit": "", "value": sum(not jump.is_found for jump in jumps)}]
    for name in (*HEIGHTS, *EVENTS):
        is_height = name in HEIGHTS
        errors = [
            (jump.stated_height_error_m if is_height else jump.stated_event_error_frames).get(name, np.nan)
            for jump in jumps
        ]
        held = [jump.within_95[name] for jump in jumps if name in jump.within_95]
        unit, scale = ("cm", 100.0) if is_height else ("frames", 1.0)
        mean = float(np.nanmean(np.abs(errors))) * scale
        rows.append({**base, "metric": name.removesuffix("_m").replace("_", " "), "unit": unit, "value": mean})
        if held:
            metric = f"{name.removesuffix('_m').replace('_', ' ')}, in its 95 %"
            rows.append({**base, "metric": metric, "unit": "%", "value": 100 * float(np.mean(held))})
    append("jumps", rows)


if __name__ == "__main__":
    main()
