"""A camera that was moved: `python benchmarks/accuracy/moved_camera.py [SEED ...]`.

Synthetic blocks of the usual difficulty and hard ones, of one and two blockers: as they are, with each of three cameras
turned by 8, 18 or 40 pixels in some direction, and by 18 pixels from the middle on (seeds 7401 to 7404; about four
minutes). What is called tracked must lie on the player; see `hidden_legs.py`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from accuracy.hidden_legs import follow, rows_of
from rows import append

from airborne.video import Frames

SEEDS = (7401, 7402, 7403, 7404)
N_CAMERAS, MIDDLE = 3, 41
TURNS = {"8 px": (8, 0), "18 px": (18, 0), "40 px": (40, 0), "18 px from the middle on": (18, MIDDLE)}


def alterations(frames: Frames) -> Iterator[tuple[str, Frames]]:
    """Yield a time in all its forms."""
    yield "as it is", frames
    for i, (name, (px, first)) in enumerate(TURNS.items()):
        for camera in range(N_CAMERAS):
            angle = np.random.default_rng([i, camera]).uniform(0, 2 * np.pi)
            offset = px * np.cos(angle), px * np.sin(angle)
            views = list(frames.views)
            if (view := views[camera]) is not None and frames.index >= first:
                turned = view.camera.resample(scale=(1, 1), offset=offset, size=view.camera.size)
                views[camera] = replace(view, camera=turned)
            yield f"a camera turned by {name}", replace(frames, views=tuple(views))


def main(seeds: list[int]) -> None:
    """Track, reduce, append the rows."""
    rows = []
    for difficulty in ("default", "hard"):
        found: dict[str, list] = {}
        for seed in seeds:
            for name, joints in follow(seed, difficulty, alterations, n_blockers=1 + seed % 2).items():
                found.setdefault(name, []).extend(joints)
        rows += rows_of(found, difficulty)
    append("moved_camera", rows)


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or list(SEEDS))
