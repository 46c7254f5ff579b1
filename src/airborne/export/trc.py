"""TRC files: markers over time, tab-separated, y up, metres."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airborne.export.takes import Take
from airborne.io.writing import replace_text

_Y_UP = (1, 2, 0)  # TRC's x, y, z are the world's y, z, x
_HEADER = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"


def write_trc(path: Path, take: Take) -> None:
    """Write a take's markers [m]; missing values are a literal NaN, which OpenSim too reads as missing.

    So are points that the images do not show, guesses that nothing else in the file would tell from the others.
    """
    rate, n, n_markers = repr(float(take.rate)), len(take), len(take.markers)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        _HEADER,
        f"{rate}\t{rate}\t{n}\t{n_markers}\tm\t{rate}\t{take.frame[0]}\t{n}",
        "Frame#\tTime\t" + "\t\t\t".join(take.markers) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(n_markers) for axis in "XYZ"),
        "",
    ]
    values, is_known = take.points[..., _Y_UP].reshape(n, -1), np.isfinite(take.points).all(axis=-1)
    values[~np.repeat(is_known & ~np.isinf(take.sd), 3, axis=1)] = np.nan
    for frame, time_s, row in zip(take.frame, take.time_s, values.tolist(), strict=True):
        cells = ("NaN" if x != x else f"{x:.7f}" for x in row)
        lines.append("\t".join([str(frame), f"{time_s:.9f}", *cells]))
    replace_text(path, "\n".join(lines) + "\n", is_durable=False)
