"""How alike trackers err in frames near by: `python benchmarks/accuracy/block_errors.py FOLDER`.

FOLDER is what `airborne reproduce blockjump -o FOLDER` left. Errors of heights of hips, knees and ankles: half of the
mean squared difference over some frames, as a share of the variance. White noise would be 1 from the first frame on.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

FRAMES = (1, 5, 20)
METHODS = {"blocker": "blocker-tracked-", "block-jump": "block-jump-tracked-1500-"}
_WARM_UP = 3  # frames


def main(folder: Path) -> None:
    """Pool all sequences and seeds; append the rows."""
    for method, key in METHODS.items():
        errors = []
        for path in sorted((folder / "sequences").glob("*.npz")):
            with np.load(path) as arrays:
                for name in arrays:
                    if name.startswith(key) and not name.endswith("covariance"):
                        truth = arrays[f"truth/{name.rsplit('/', 1)[1]}"]
                        errors.append((arrays[name] - truth)[_WARM_UP:, :, 2])
        variance = np.mean([np.var(each) for each in errors])
        base = {"data": f"{len(errors)} tracks at 60 frames/s", "method": method, "unit": "%", "n": len(errors)}
        rows = []
        for n in FRAMES:
            half = np.mean([np.mean((each[n:] - each[:-n]) ** 2) for each in errors]) / 2
            rows.append({**base, "metric": f"change over {n} frames", "value": 100 * float(half / variance)})
        append("block_errors", rows)


if __name__ == "__main__":
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "sequences").is_dir():
        sys.exit("give the folder that `airborne reproduce blockjump -o FOLDER` left")
    main(Path(sys.argv[1]))
