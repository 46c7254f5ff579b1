"""Make paper B's synthetic experiment anew: `python benchmarks/accuracy/reproduce_rigid.py` (minutes)."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.reproduction import reproduce_rigid

FLOORS = {  # RMS of each position [mm], of each angle [deg]
    ("faithful", "skin"): (5.0, 0.35),
    ("refined", "skin"): (1.5, 0.12),
    ("refined", "ellipsoids"): (0.1, 0.02),
}


def rows(summary: dict) -> list[dict]:
    """Turn the summary into rows: RMS of every variable, poses lost, basins."""
    found = []
    for target in ("skin", "ellipsoids"):
        for method, values in summary[target].items():
            n = summary["n_poses"] * (len(summary["persons"]) if target == "skin" else 1)
            base = {"data": f"somersault, 11 poses, {target}", "method": method, "n": n}
            floors = FLOORS.get((method, target), (None, None))
            for name, unit, rms in zip(summary["variables"], summary["units"], values["rms"], strict=True):
                floor = floors[unit == "deg"]
                found.append({**base, "metric": f"{name} RMS", "unit": unit, "value": rms, "floor": floor})
            found.append({**base, "metric": "poses lost", "unit": "", "value": values["n_lost"], "floor": 0})
    for bodies, widths in summary["basin_half_width"].items():
        for name, unit, width in zip(summary["variables"], summary["units"], widths["median"], strict=True):
            base = {"data": f"somersault, {bodies}", "method": "RGB score", "n": summary["n_poses"]}
            found.append({**base, "metric": f"{name} basin half-width, median", "unit": unit, "value": width})
    return found


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        append("reproduce_rigid", rows(reproduce_rigid(Path(folder) / "rigid")))
