"""C3D files: markers over time in millimetres, little-endian floats, no analogue channels.

Source: "The C3D File Format: A Technical User Guide" (c3d.org): header, parameter section, 3D point data in
floating-point format.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airborne import __version__
from airborne.errors import ResultError
from airborne.export.takes import Take
from airborne.types import Array, Array32

LARGEST_RESIDUAL_MM = 100.0  # larger ones, and infinite ones, are written as this
# bytes of a block, the processor code of Intel, the key of a C3D file (C3D format manual)
_BLOCK, _INTEL, _KEY = 512, 84, 0x50
_LARGEST_WORD = 0xFFFF  # of the frame counts in the header
_LARGEST_INTEGER = 32000  # of a coordinate, should the file be converted to integers
_LABELS_A_PARAMETER = 255  # a dimension is one byte
_MOST_BLOCKS = 255  # their count is one byte
ParameterValue = str | list[str] | float | list[int]


def write_c3d(path: Path, takes: Sequence[Take]) -> None:
    """Write the markers of takes with the same frames, world axes (z up); several bodies' labels as `name:marker`.

    The residual is the point's standard deviation in mm, in steps of |POINT:SCALE|, at least one; 0 where that is
    unknown. A missing point has coordinates 0 and the residual -1. Frames keep their numbers unless these pass 65,535;
    then they begin at 1. Raises ResultError where the labels are too many.
    """
    labels = [f"{take.name}:{marker}" if take.name else marker for take in takes for marker in take.markers]
    points_mm = 1e3 * np.concatenate([take.points for take in takes], axis=1)
    sd_mm = 1e3 * np.concatenate([take.sd for take in takes], axis=1)
    scale_mm = _scale_mm(points_mm, sd_mm)
    parameters = _parameters(takes, labels, scale_mm, data_block=0)
    n_blocks = len(parameters) // _BLOCK
    if n_blocks > _MOST_BLOCKS:
        raise ResultError(f"{len(labels)} markers are more than a C3D file can name; export fewer")
    data_block = 2 + n_blocks
    data = _data(points_mm, sd_mm, scale_mm).tobytes()
    if len(takes[0]) <= _LARGEST_WORD:  # of a longer file, readers take the number of frames from its size
        data += bytes(-len(data) % _BLOCK)
    with path.open("wb") as file:
        file.write(_header(takes[0], len(labels), scale_mm, data_block))
        file.write(_parameters(takes, labels, scale_mm, data_block=data_block))
        file.write(data)


def _scale_mm(points_mm: Array, sd_mm: Array) -> float:
    """Return the step of the residuals, large enough for the largest, and for coordinates as 16-bit integers."""
    largest = np.nanmax(np.abs(points_mm), initial=1.0)
    spread = min(np.nanmax(sd_mm, initial=0.0), LARGEST_RESIDUAL_MM)
    return float(np.float32(max(largest / _LARGEST_INTEGER, spread / 255)))


def _data(points_mm: Array, sd_mm: Array, scale_mm: float) -> Array32:
    """Lay out (n, markers, 4): x, y, z and the fourth word, whose low byte is the residual; its cameras are unknown."""
    is_known = np.isfinite(points_mm).all(axis=-1)
    steps = np.clip(np.rint(np.nan_to_num(sd_mm, nan=0.0, posinf=np.inf) / scale_mm), 1, 255)
    word = np.where(np.isnan(sd_mm), 0.0, steps)
    data = np.concatenate([points_mm, word[..., None]], axis=-1)
    data[~is_known] = (0, 0, 0, -1)
    return data.astype("<f4")


def _frame_range(take: Take) -> tuple[int, int]:
    """Return the numbers of the first and the last frame."""
    last = int(take.frame[-1])
    return (int(take.frame[0]), last) if last <= _LARGEST_WORD else (1, len(take))


def _header(take: Take, n_markers: int, scale_mm: float, data_block: int) -> bytes:
    first, last = (min(frame, _LARGEST_WORD) for frame in _frame_range(take))
    words = struct.pack(
        "<BBHHHHHfHHf", 2, _KEY, n_markers, 0, first, last, 0, -scale_mm, data_block, 0, float(take.rate)
    )
    return words.ljust(_BLOCK, b"\0")


def _parameters(takes: Sequence[Take], labels: list[str], scale_mm: float, *, data_block: int) -> bytes:
    """Lay out the parameter section in whole blocks."""
    take, rate = takes[0], float(takes[0].rate)
    start, end = (list(struct.unpack("<HH", struct.pack("<I", frame))) for frame in _frame_range(take))
    groups: dict[str, tuple[str, dict[str, ParameterValue]]] = {
        "POINT": (
            "residual: standard deviation of the point",
            {
                "USED": [len(labels)],
                "SCALE": -scale_mm,
                "RATE": rate,
                "DATA_START": [data_block],
                "FRAMES": [min(len(take), _LARGEST_WORD)],
                "UNITS": "mm",
                "X_SCREEN": "+X",
                "Y_SCREEN": "+Z",
                **_split("LABELS", labels),
                **_split("DESCRIPTIONS", [""] * len(labels)),
            },
        ),
        "TRIAL": ("", {"ACTUAL_START_FIELD": start, "ACTUAL_END_FIELD": end, "CAMERA_RATE": rate}),
        "ANALOG": ("none", {"USED": [0], "GEN_SCALE": 1.0, "RATE": 0.0}),
        "FORCE_PLATFORM": ("none", {"USED": [0]}),
        "MANUFACTURER": ("", {"COMPANY": "Airborne", "SOFTWARE": f"Airborne {__version__}"}),
    }
    if takes[0].name:
        names = [take.name for take in takes]
        groups["SUBJECTS"] = (
            "",
            {
                "IS_STATIC": [0],
                "USES_PREFIXES": [1],
                "USED": [len(names)],
                "NAMES": names,
                "LABEL_PREFIXES": [f"{name}:" for name in names],
            },
        )
    records = b""
    for number, (name, (description, parameters)) in enumerate(groups.items(), start=1):
        records += _record(name, -number, struct.pack("<B", len(description)) + description.encode())
        records += b"".join(_record(key, number, _value(value) + b"\0") for key, value in parameters.items())
    n_blocks = -(-(4 + len(records) + 2) // _BLOCK)
    return (bytes([1, _KEY, min(n_blocks, 255), _INTEL]) + records).ljust(n_blocks * _BLOCK, b"\0")


def _split(name: str, texts: list[str]) -> dict[str, ParameterValue]:
    """Spread a long list over NAME, NAME2, NAME3 and so on."""
    parts = [texts[k : k + _LABELS_A_PARAMETER] for k in range(0, len(texts), _LABELS_A_PARAMETER)]
    return {name if k == 0 else f"{name}{k + 1}": part for k, part in enumerate(parts)}


def _record(name: str, number: int, content: bytes) -> bytes:
    """Return a group's or a parameter's record; `content` is what follows the pointer to the next one."""
    return struct.pack("<bb", len(name), number) + name.encode() + struct.pack("<H", 2 + len(content)) + content


def _value(value: ParameterValue) -> bytes:
    """Return type, dimensions and data: texts of one width, a float, or 16-bit integers."""
    if isinstance(value, float | int):
        return struct.pack("<bBf", 4, 0, value)
    if isinstance(value, str):
        return struct.pack("<bBB", -1, 1, len(value)) + value.encode()
    texts = [each.encode() for each in value if isinstance(each, str)]
    if texts:
        width = max(1, *map(len, texts))
        return struct.pack("<bBBB", -1, 2, width, len(texts)) + b"".join(text.ljust(width) for text in texts)
    return struct.pack("<bBB", 2, 1, len(value)) + np.array(value, "<u2").tobytes()
