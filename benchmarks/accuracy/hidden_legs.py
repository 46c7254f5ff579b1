"""Legs that others hide: `python benchmarks/accuracy/hidden_legs.py [SEED ...]`.

Synthetic blocks with team-mates before the blocker, of the usual difficulty and hard ones, as the cameras see them, at
half the size and without each camera (seeds 7101 to 7104; about two minutes). What is called tracked must lie on the
player: rows count the hips, knees and ankles that lie 0.15 m off or more, and those of them that are called tracked.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body.legs import LEG_POINTS
from airborne.synthetic.block.pictures import block_frames
from airborne.synthetic.block.scene import DIFFICULTIES, block_scene
from airborne.synthetic.block.truth import noisy_starts, true_joints
from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.players import PlayerStart
from airborne.video import Frames
from airborne.video.small import shrink

SEEDS = (7101, 7102, 7103, 7104)
FAR_M = 0.15  # a shank is 0.1 m wide: a leg this far off lies beside the player's
INSIDE_95 = 7.815  # squared distance that 95 % of a Gaussian in space lie within


def alterations(frames: Frames) -> Iterator[tuple[str, Frames]]:
    """Yield a time in all its forms."""
    yield "whole", frames
    yield (
        "half the size",
        replace(frames, views=tuple(view and shrink(view, view.camera.size[0] // 2) for view in frames.views)),
    )
    for left_out in range(len(frames.views)):
        views = tuple(None if k == left_out else view for k, view in enumerate(frames.views))
        yield "without a camera", replace(frames, views=views)


def follow(
    seed: int, difficulty: str, alter: Callable[[Frames], Iterator[tuple[str, Frames]]], *, n_blockers: int = 1
) -> dict[str, list[tuple[float, bool, bool]]]:
    """Track a scene in all its forms; return of each hip, knee and ankle its error [m], if it is held, if tracked."""
    scene = block_scene(seed, n_blockers=n_blockers, difficulty=DIFFICULTIES[difficulty])
    paths = {player.name: true_joints(player, scene.times_s) for player in scene.blockers}
    truth = {name: np.stack([of[joint] for joint in LEG_POINTS], axis=1) for name, of in paths.items()}
    tracking = Blocker([PlayerStart(name=name, joints_m=at) for name, at in noisy_starts(scene).items()])
    states: list = []
    found: dict[str, list] = {}
    for k, frames in enumerate(block_frames(scene)):
        altered = list(alter(frames))
        states = states or [tracking.init() for _ in altered]
        for i, (name, each) in enumerate(altered):
            states[i], estimates = tracking.step(states[i], each)
            for estimate in estimates:
                if estimate.status is Status.LOST:
                    continue
                error = (estimate.points[:6] - truth[estimate.player][k])[:, :, None]
                squared = (error.swapaxes(1, 2) @ np.linalg.solve(estimate.covariance[:6], error))[:, 0, 0]
                is_tracked = [status is Status.TRACKED for status in estimate.joint_status[:6]]
                distance_m = np.linalg.norm(error[..., 0], axis=1)
                found.setdefault(name, []).extend(zip(distance_m, squared < INSIDE_95, is_tracked, strict=True))
    return found


def rows_of(found: dict[str, list[tuple[float, bool, bool]]], difficulty: str) -> list[dict]:
    """Reduce what was found in each form."""
    rows = []
    for name, joints in found.items():
        distance_m, is_held, is_tracked = map(np.array, zip(*joints, strict=True))
        is_far = distance_m >= FAR_M
        base = {"data": f"blocks, {difficulty}, {name}", "method": "blocker", "n": len(joints)}
        rows += [
            {**base, "metric": "mean joint error", "unit": "mm", "value": float(1e3 * distance_m.mean())},
            {**base, "metric": "joints 150 mm off", "unit": "", "value": int(is_far.sum())},
            {**base, "metric": "of them tracked", "unit": "", "value": int((is_far & is_tracked).sum()), "floor": "0"},
            {**base, "metric": "joints tracked", "unit": "%", "value": float(100 * is_tracked.mean())},
            {**base, "metric": "in the 95 % region", "unit": "%", "value": float(100 * is_held.mean()),
             "floor": "88..99"},
        ]  # fmt: skip
    return rows


def main(seeds: list[int]) -> None:
    """Track, reduce, append the rows."""
    rows = []
    for difficulty in ("default", "hard"):
        found: dict[str, list] = {}
        for seed in seeds:
            for name, joints in follow(seed, difficulty, alterations).items():
                found.setdefault(name, []).extend(joints)
        rows += rows_of(found, difficulty)
    append("hidden_legs", rows)


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or list(SEEDS))
