"""The true motion of a body."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.evaluation.table import read_table
from airborne.types import Array

_POSITION = ["x_m", "y_m", "z_m"]
_ROTATION = [f"r{i}{j}" for i in range(3) for j in range(3)]
_EXPECTED = "a truth table with the columns frame (or field), time_s, x_m, y_m, z_m, r00..r22"
_NOT_ROTATION = 1e-3  # a table rounded to three digits is still a rotation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """The true poses of the body's root."""

    index: NDArray[np.int64]  # (n,) frame or field numbers
    time_s: Array  # (n,) increasing [s]
    position: Array  # (n, 3) [m]
    R: Array  # (n, 3, 3) world from root


def read_truth(path: Path) -> Truth:
    """Read a truth table: `frame` or `field`, `time_s`, position [m], world-from-root matrix row by row.

    Raises ResultError in one line for a missing column or number, a matrix that is not a rotation, or times that do not
    increase.
    """
    table = read_table(path, _EXPECTED)
    missing = [name for name in ["time_s", *_POSITION, *_ROTATION] if name not in table.names]
    index_name = next((name for name in ("frame", "field") if name in table.names), None)
    if missing or index_name is None:
        absent = ", ".join(missing) if missing else "frame (or field)"
        hint = "; it holds paths of joints: give it as joints (--joints)" if "joint" in table.names else ""
        raise ResultError(f"{path} has no column {absent}; expected {_EXPECTED}{hint}")
    values = table.numbers(["time_s", *_POSITION, *_ROTATION])
    time_s, position, R = values[:, 0], values[:, 1:4], values[:, 4:].reshape(-1, 3, 3)
    for row, line in enumerate(table.line_numbers):
        if not np.isfinite(values[row]).all():
            raise ResultError(
                f"{path} line {line} has an empty cell; a truth needs every number, or leave the line out"
            )
        if np.abs(R[row].T @ R[row] - np.eye(3)).max() > _NOT_ROTATION or np.linalg.det(R[row]) < 0:
            raise ResultError(f"{path} line {line}: r00..r22 are not a rotation; write world from body, row by row")
        if row and time_s[row] <= time_s[row - 1]:
            raise ResultError(f"{path} line {line}: time_s {time_s[row]:g} is not after the line before; sort by time")
    return Truth(index=table.whole_numbers(index_name), time_s=time_s, position=position, R=R)
