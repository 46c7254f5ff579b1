"""Caliscope's `camera_array.toml`: tables [cameras.0], [cameras.1], ... in metres.

`rotation_count` rotates images only for its pose networks; the calibration is that of the images as recorded.
"""

from __future__ import annotations

from collections.abc import Mapping

from airborne.cameras.camera import Rig
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.formats.toml import camera_from_table, table_lines, toml_value
from airborne.errors import CalibrationError

_ABSENT = (None, "null")


def rig_from_caliscope(document: dict, where: str, options: FileOptions) -> Rig:
    """Return the cameras that have a pose, named cam_<number> as Caliscope names their videos."""
    tables = {key: table for key, table in document["cameras"].items() if isinstance(table, dict)}
    posed = {key: table for key, table in tables.items() if table.get("rotation") not in _ABSENT}
    if not posed:
        raise CalibrationError(f"{where}: none of its {len(tables)} cameras has a pose; calibrate their extrinsics")
    metres = options.metres("m")
    return Rig(
        tuple(
            camera_from_table(f"{where}, [cameras.{key[:60]}]", f"cam_{key}", table, metres)
            for key, table in posed.items()
        )
    )


def caliscope_text(rig: Rig, errors_px: Mapping[str, float] | None = None) -> str:
    """Return a Caliscope file."""
    lines = []
    for number, camera in zip(caliscope_numbers(rig), rig, strict=True):
        lines += [
            f"[cameras.{number}]",
            f"cam_id = {number}",
            f"size = {toml_value(list(camera.size))}",
            "rotation_count = 0",
            *([f"error = {float(errors_px[camera.name])!r}"] if errors_px else []),
            *table_lines(camera, n_terms=4 if camera.lens == "fisheye" else 5),
            "",
        ]
    return "\n".join(lines)


def caliscope_numbers(rig: Rig) -> list[int]:
    """Return the cameras' numbers: those of their names where all are cam_<number>, else 0, 1, 2, ..."""
    digits = [name.removeprefix("cam_") for name in rig.names]
    if all(text.isascii() and text.isdigit() and text == str(int(text)) for text in digits if len(text) < 10):
        own = [f"cam_{text}" for text in digits]
        if own == list(rig.names) and max(map(len, digits)) < 10:
            return [int(text) for text in digits]
    return list(range(len(rig)))


def caliscope_losses(rig: Rig) -> tuple[str, ...]:
    """Return what a Caliscope file cannot hold, a phrase each."""
    pairs = zip(rig.names, caliscope_numbers(rig), strict=True)
    renamed = [f"{name} is {number}" for name, number in pairs if name != f"cam_{number}"]
    return (f"names: Caliscope numbers its cameras: {', '.join(renamed)}",) if renamed else ()
