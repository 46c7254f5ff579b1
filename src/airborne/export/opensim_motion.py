"""Motion files of OpenSim (.mot): the coordinates of `write_osim`'s model over time, in degrees and metres."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airborne.export.opensim_model import GROUND_FROM_WORLD, coordinate_names
from airborne.export.takes import Take, part_paths
from airborne.io.writing import replace_text


def write_mot(path: Path, take: Take) -> list[Path]:
    """Write a take's angles, unwrapped over time, and return the files: one for each stretch without a gap.

    OpenSim stops reading at the first NaN and draws lines across rows left out, so a gap ends a file; with several,
    they are named `<stem>_part1.mot` and so on. Without any pose there is no file.
    """
    stretches = take.stretches()
    paths = part_paths(path, len(stretches)) if stretches else []
    angles = np.rad2deg(np.concatenate([take.root_angles, take.joint_angles.reshape(len(take), -1)], axis=1))
    translations = take.position @ GROUND_FROM_WORLD.T
    values = np.concatenate([take.time_s[:, None], angles[:, :3], translations, angles[:, 3:]], axis=1)
    names = ["time", *coordinate_names(take.model)]
    for part, rows in zip(paths, stretches, strict=True):
        head = [part.stem, "version=1", f"nRows={rows.stop - rows.start}", f"nColumns={len(names)}", "inDegrees=yes"]
        lines = [*head, "endheader", "\t".join(names)]
        lines += ["\t".join([f"{time_s:.9f}", *(f"{x:.9g}" for x in row)]) for time_s, *row in values[rows].tolist()]
        replace_text(part, "\n".join(lines) + "\n", is_durable=False)
    return paths
