"""aniposelib's and FreeMoCap's TOML: Pose2Sim's layout under the keys cam_0, cam_1, ...; read by `rig_from_tables`."""

from __future__ import annotations

from airborne.cameras.camera import Rig
from airborne.cameras.formats.options import METRES, Unit
from airborne.cameras.formats.toml import table_lines, toml_value


def aniposelib_text(rig: Rig, unit: Unit = "m") -> str:
    """Return an aniposelib file, lengths in the unit; the keys have as many digits as keep them in order as text."""
    digits = len(str(len(rig) - 1))
    lines = []
    for number, camera in enumerate(rig):
        lines += [
            f"[cam_{number:0{digits}}]",
            f"name = {toml_value(camera.name)}",
            f"size = {toml_value(list(camera.size))}",
            *table_lines(camera, n_terms=4 if camera.lens == "fisheye" else 5, metres=METRES[unit]),
            "",
        ]
    return "\n".join([*lines, "[metadata]", "adjusted = false"]) + "\n"
