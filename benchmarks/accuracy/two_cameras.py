"""People seen by two cameras: `python benchmarks/accuracy/two_cameras.py [SEED ...]`.

Synthetic somersaults of people with a skin of their own, in a hall, tracked with a preset body by three cameras and by
each two of them, of their stature and a tenth too tall (seeds 121 to 124, some fifteen minutes). Rows count the joints
that are called tracked, and how many of them are over 0.1 m off, which none should be.
"""

from __future__ import annotations

import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.errors import AirborneError
from airborne.evaluation import JointComparison, compare_joints, read_joint_paths
from airborne.motion.run_folder import read_body_run
from airborne.run.track import track_trial
from airborne.synthetic import write_somersault
from airborne.synthetic.flight.somersault import MASS_KG, STATURE_M
from airborne.trial.body import BodyTable
from airborne.trial.file import read_trial

SEEDS = (121, 122, 123, 124)  # others were looked at when constants were chosen
CAMERAS = ("front", "side", "top")
BODIES = {
    "": BodyTable(preset="human18", stature_m=STATURE_M, mass_kg=MASS_KG),
    ", too tall": BodyTable(preset="human18", stature_m=1.84, mass_kg=74.0),  # by a tenth: as if of somebody else
}


def follow(seed: int) -> Iterator[tuple[str, JointComparison]]:
    """Yield the joints of a person as each choice of cameras finds them; one that cannot be tracked is named."""
    with tempfile.TemporaryDirectory() as name:
        folder, preset = Path(name), "pike" if seed % 2 == 0 else "moving-arms"
        write_somersault(folder, preset=preset, target="skin", style="gym", seed=seed)
        truth = read_joint_paths(folder / "truth_joints.csv")
        for cameras in (CAMERAS, *(tuple(each for each in CAMERAS if each != left_out) for left_out in CAMERAS)):
            trial = read_trial(folder / "trial.toml", cameras=cameras)
            for change, body in BODIES.items():
                run = folder / ("-".join(cameras) + change)
                try:
                    track_trial(trial.model_copy(update={"body": body}), run, pictures=False)
                except AirborneError as error:
                    print(f"seed {seed}, {', '.join(cameras)}{change}: {error}")
                else:
                    yield f"{len(cameras)} cameras{change}", compare_joints(*read_body_run(run), truth)


def rows_of(method: str, found: Sequence[JointComparison]) -> list[dict]:
    """Return the rows of all people as so many cameras find them."""
    n = sum(each.whole.n for each in found)
    n_tracked = sum(each.share_tracked * each.whole.n for each in found)
    common = {"data": "synthetic somersaults", "method": method, "n": n}
    held = sum(each.coverage_with_offset.within_95 * each.whole.n for each in found) / n
    return [
        {**common, "metric": "mean joint error, median of runs", "unit": "mm",
         "value": float(np.median([each.whole.mean_mm for each in found]))},
        {**common, "metric": "joints tracked", "unit": "", "value": n_tracked / n},
        {**common, "metric": "of them over 100 mm off", "unit": "%",
         "value": 100 * sum(each.n_far for each in found) / max(n_tracked, 1), "floor": "0"},
        {**common, "metric": "held by the 95 % interval", "unit": "", "value": held, "floor": "0.88..0.99"},
    ]  # fmt: skip


def main(seeds: Sequence[int]) -> None:
    """Track, reduce, append the rows."""
    found: dict[str, list[JointComparison]] = defaultdict(list)
    for seed in seeds:
        for method, comparison in follow(seed):
            found[method].append(comparison)
    append("two_cameras", [row for method, of in found.items() for row in rows_of(method, of)])


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or SEEDS)
