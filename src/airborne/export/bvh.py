"""BVH: a skeleton and its motion, for animation programs. Centimetres, y up, the body's x axis to the subject's left.

Source: the layout that Biovision's files have and every animation program reads: HIERARCHY, then MOTION.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airborne.body import BodyModel
from airborne.export.takes import Take, part_paths, portable_names
from airborne.io.writing import replace_text
from airborne.types import Array

_CM = 100.0  # to a metre: the usual unit of BVH files
_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # x, z, -y: at rest the body looks along z
_CHANNELS = "Xrotation Zrotation Yrotation"  # our x, -y and z, in our order, so that no angle ever jumps


def write_bvh(path: Path, take: Take) -> list[Path]:
    """Write a take's skeleton and angles, and return the files: one for each stretch without a gap.

    With several stretches they are named `<stem>_part1.bvh` and so on; without any pose there is no file.
    """
    stretches = take.stretches()
    paths = part_paths(path, len(stretches)) if stretches else []
    angles = np.concatenate([take.root_angles[:, None], take.joint_angles], axis=1)
    lines_above, order = _hierarchy(take.model)
    degrees = np.rad2deg(angles[:, order] * [1, -1, 1]).reshape(len(take), -1)
    values = np.concatenate([_CM * take.position @ _Y_UP.T, degrees], axis=1)
    for part, rows in zip(paths, stretches, strict=True):
        lines = [*lines_above, "MOTION", f"Frames: {rows.stop - rows.start}"]
        lines.append(f"Frame Time: {1 / float(take.rate)!r}")
        lines += [" ".join(f"{x:.6f}" for x in row) for row in values[rows].tolist()]
        replace_text(part, "\n".join(lines) + "\n", is_durable=False)
    return paths


def _hierarchy(model: BodyModel) -> tuple[list[str], list[int]]:
    """Return the lines of the skeleton, and the segments in depth-first order, each before its children."""
    names = portable_names([segment.name for segment in model.segments])
    lines, order = ["HIERARCHY"], []

    def add(k: int, depth: int) -> None:
        indent, segment, children = "\t" * depth, model.segments[k], np.flatnonzero(model.parents == k)
        order.append(k)
        lines.append(f"{indent}{'JOINT' if depth else 'ROOT'} {names[k]}")
        lines.append(f"{indent}{{")
        lines.append(f"{indent}\tOFFSET {_offset(segment.joint_m if depth else np.zeros(3))}")
        position = "" if depth else "Xposition Yposition Zposition "
        lines.append(f"{indent}\tCHANNELS {3 if depth else 6} {position}{_CHANNELS}")
        for child in children:
            add(int(child), depth + 1)
        if not len(children):
            lines.extend([f"{indent}\tEnd Site", f"{indent}\t{{", f"{indent}\t\tOFFSET {_end_site(model, k)}"])
            lines.append(f"{indent}\t}}")
        lines.append(f"{indent}}}")

    add(0, 0)
    return lines, order


def _end_site(model: BodyModel, k: int) -> str:
    """Return the offset of a leaf's end site: its landmark farthest from the joint, or the middle of its first part."""
    segment = model.segments[k]
    own = [landmark.position_m for landmark in model.landmarks if landmark.segment == segment.name]
    middle = [segment.parts[0].segment_from_part.translation] if segment.parts else []
    return _offset(max([*own, *middle, np.zeros(3)], key=lambda point: float(np.linalg.norm(point))))


def _offset(offset_m: Array) -> str:
    return " ".join(f"{x:.6f}" for x in _CM * (_Y_UP @ offset_m) + 0.0)
