"""Measure how often players out of sight for a second are found again: `python benchmarks/accuracy/found_again.py`.

30 synthetic blocks of two blockers, dressed as their team-mates are; in half of the scenes both leave, in the others
one (about 35 minutes of CPU); `--quick` takes 2, `--seeds 6100-6109` others, and neither writes rows. Right is a mean
error of the legs up to 80 mm at the end, 0.7 s after the return, of those who left; wrong is anybody who is said to be
0.3 m elsewhere.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from finding import measure

from airborne.synthetic.block.pictures import block_frames
from airborne.synthetic.block.scene import Difficulty, block_scene
from airborne.synthetic.block.truth import noisy_starts, true_joints
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.players import PlayerStart

_RIGHT_M, _ELSEWHERE_M = 0.08, 0.3  # mean errors of the legs
_RATE, _N_FRAMES = 30, 66
_LEAVES, _RETURNS = 12, 45  # frames


def verdict(seed: int) -> tuple[str, float]:
    """Track one block; return right, wrong or undecided (lost to the end), and the CPU time [s] of tracking."""
    scene = block_scene(seed, n_blockers=2, difficulty=Difficulty(frame_rate=_RATE), n_frames=_N_FRAMES)
    away = scene.blockers if seed % 2 else scene.blockers[:1]
    without = replace(scene, players=tuple(player for player in scene.players if player not in away))
    frames = chain(
        block_frames(scene, range(_LEAVES)),
        block_frames(without, range(_LEAVES, _RETURNS)),
        block_frames(scene, range(_RETURNS, _N_FRAMES)),
    )
    given = {name: joints for name, joints in noisy_starts(scene).items() if "hip_left" in joints}
    tracker = Blocker([PlayerStart(name=name, joints_m=joints) for name, joints in given.items()])
    state, cpu_s, notes, estimates = tracker.init(), 0.0, [], ()
    for each in frames:
        start_s = time.process_time()
        state, estimates = tracker.step(state, each)
        cpu_s += time.process_time() - start_s
        notes += [f"{one.player}, frame {one.index}: {one.note}" for one in estimates if one.note]
    words = []
    for player, estimate in zip(scene.blockers, estimates, strict=True):
        joints = true_joints(player, scene.times_s[-1:])
        truth = np.array([joints[joint][0] for joint in tracker.joints[:8]])
        off_m = float(np.linalg.norm(estimate.points[:8] - truth, axis=1).mean())
        is_lost = estimate.status is Status.LOST
        is_near = off_m <= (_RIGHT_M if player in away else _ELSEWHERE_M)
        words.append("undecided" if is_lost else "right" if is_near else "wrong" if off_m > _ELSEWHERE_M else "off")
        print(f"{scene.name}, {player.name}: {words[-1]}, {1e3 * off_m:.0f} mm off, {cpu_s:.1f} s; {notes}", flush=True)
    worst = next((word for word in ("wrong", "undecided", "off") if word in words), "right")
    return worst, cpu_s


if __name__ == "__main__":
    measure(
        "found_again", "blocks", verdict, seeds=(6000, 6029), n_quick=2, floors=(">= 90", "0"), found_is="found again"
    )
