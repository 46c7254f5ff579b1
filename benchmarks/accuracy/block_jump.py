"""Track the recorded block jump: `python benchmarks/accuracy/block_jump.py [FOLDER] [--method blocker]`.

FOLDER holds the recording `block_jump`; by default it is looked for beside the project. A team mate hides the blocker
from one camera for much of the clip. Motion, bodies and pictures are not made by this project.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.evaluation.players import assess_players
from airborne.run.track import track_trial
from airborne.trial.file import read_trial


def main(data: Path, method: str) -> None:
    """Track, compare, append the rows."""
    trial = read_trial(data / "trial.toml", {"method": method})
    with tempfile.TemporaryDirectory() as name:
        track_trial(trial, Path(name), pictures=False)
        found = assess_players(Path(name), data / "truth.csv").to_dict()
    player, jump = found["players"]["blocker1"], found["jumps"][0]
    base = {"data": "block_jump, recorded", "method": method, "n": found["n_matched"]}
    rows: list[dict] = [{**base, "metric": "frames lost", "unit": "", "value": player["n_lost"], "floor": 0}]
    for part in ("hips", "knees", "ankles"):
        errors = player["parts"][part]
        share = 100 * errors["within_95"]
        rows.append({**base, "metric": f"{part}, mean 3D error", "unit": "mm", "value": errors["mean_mm"], "floor": 45})
        rows.append({**base, "metric": f"{part}, in the 95 % region", "unit": "%", "value": share, "floor": "about 95"})
    stated, of_paths = jump["stated_height_error_m"], jump["height_error_m"]
    for name in of_paths:
        against, error = ("stated", stated[name]) if name in stated else ("true path", of_paths[name])
        metric = f"{name.removesuffix('_m').replace('_', ' ')}, less the {against}"
        rows.append({**base, "metric": metric, "unit": "cm", "value": 100 * error, "n": 1, "floor": "±2"})
    for name, error in jump["stated_event_error_frames"].items():
        rows.append(
            {**base, "metric": name.replace("_frame", ""), "unit": "frames", "value": error, "n": 1, "floor": "±1"}
        )
    append("block_jump", rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT.parent / "shared" / "data" / "block_jump")
    parser.add_argument("--method", default="blocker")
    given = parser.parse_args()
    if not given.folder.is_dir():
        sys.exit(f"the recording is not at {given.folder}; give its folder")
    main(given.folder, given.method)
