"""How well a thrown cross is tracked that moves while an image is exposed, with `exposure_s` known and without.

`python benchmarks/accuracy/motion_blur.py [--quick]`: throws with exact cameras; a tip of the cross moves by up to 0.7
pixels in a millisecond. The first three frames, which know no motion yet, are left out.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from sys import path

import numpy as np

path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.synthetic import cross_scene
from airborne.synthetic.throw.pictures import scene_frames
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from airborne.types import Array
from airborne.video import Frames

_SEEDS = range(320, 324)
_EXPOSURES_S = (0.0005, 0.004, 0.008, 0.016)
_SKIPPED = 3


def main() -> None:
    """Track the throws, and append the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one throw, and no rows")
    quick = parser.parse_args().quick
    for exposure_s in _EXPOSURES_S[1:2] if quick else _EXPOSURES_S:
        errors: dict[str, list[Array]] = {"unknown": [], "known": []}
        for seed in _SEEDS[:1] if quick else _SEEDS:
            preset = "side-somersault" if seed % 2 else "half-twist"
            scene = replace(cross_scene(preset, seed=seed), exposure_s=exposure_s, is_surveyed=False)
            frames = list(scene_frames(scene))
            truth = scene.flight(np.array([float(scene.time_s(each.index)) for each in frames]))
            for method, given_s in (("unknown", 0.0), ("known", exposure_s)):
                tracker = RefinedTracker(scene.model, truth.pose(0))
                state = tracker.init()
                for each in frames:
                    state, estimate = step(tracker, state, _exposed(each, given_s))
                    if estimate.pose is not None and estimate.covariance is not None and each.index >= _SKIPPED:
                        true = truth.pose(each.index).world_from_root
                        off_m = estimate.pose.world_from_root.translation - true.translation
                        errors[method].append(np.array([off_m, off_m / np.sqrt(np.diag(estimate.covariance)[:3])]))
        for method, each in errors.items():
            off_m, sds = np.stack(each, axis=1)
            rms_mm, share = 1e3 * float(np.sqrt((off_m**2).sum(axis=1).mean())), 100 * float((np.abs(sds) < 2).mean())
            data = f"throws, {1e3 * exposure_s:g} ms exposed"
            rows = [
                {"metric": "position RMS", "unit": "mm", "value": rms_mm},
                {"metric": "position within 2 sd", "unit": "%", "value": share},
            ]
            rows = [{"data": data, "method": method, "n": len(off_m), **row} for row in rows]
            print(rows) if quick else append("motion_blur", rows)


def _exposed(frames: Frames, exposure_s: float) -> Frames:
    return replace(frames, views=tuple(view and replace(view, exposure_s=exposure_s) for view in frames.views))


if __name__ == "__main__":
    main()
