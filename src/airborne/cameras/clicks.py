"""Tables of named rows and numbers: points clicked in several images, or positions typed in."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from airborne.errors import CalibrationError
from airborne.io.text import read_csv
from airborne.types import Array

_FEWEST_SAME = 3  # chosen: of points that two cameras show at the very same pixels; one or two may by chance


def read_clicks(path: Path, cameras: Sequence[str], fewest: int = 2) -> tuple[tuple[str, ...], Array]:
    """Read a table `point,<camera>_u,<camera>_v,...`: the points' names and their pixels (points, cameras, 2) [px].

    NaN where a point is not seen: blank, NaN or no columns. Raises CalibrationError where fewer than `fewest` of the
    cameras have columns, where a column is of a camera written otherwise, and for a table that does not say this.
    """
    expected = "expected point,<camera>_u,<camera>_v,..."
    names, columns, values = read_named_numbers(path, "point", expected)
    unknown = [name for name in columns if name[-2:] not in ("_u", "_v")]
    if unknown:
        raise CalibrationError(f"{path.name}: column '{unknown[0]}' is not <camera>_u or <camera>_v; {expected}")
    with_columns = [name for name in cameras if f"{name}_u" in columns and f"{name}_v" in columns]
    meant = {_letters(name): name for name in cameras if name not in with_columns}
    for column in columns:
        if (name := meant.get(_letters(column[:-2]))) is not None:
            raise CalibrationError(f"{path.name}: column '{column}' is of no camera; write {name}{column[-2:]}")
    if len(with_columns) < fewest:
        raise CalibrationError(
            f"{path.name}: has columns _u and _v of {', '.join(with_columns) or 'none'} of the cameras "
            f"{', '.join(cameras)}; {'a position needs two of them' if fewest > 1 else 'give one of them'}"
        )
    px = np.full((len(names), len(cameras), 2), np.nan)
    for name in with_columns:
        px[:, cameras.index(name)] = values[:, [columns.index(f"{name}_u"), columns.index(f"{name}_v")]]
    for row, column in np.argwhere(np.isnan(px).sum(axis=2) == 1):
        raise CalibrationError(
            f"{path.name}: point '{names[row]}' has only one of {cameras[column]}_u and {cameras[column]}_v; "
            "give both, or leave both blank"
        )
    refuse_same_clicks(path.name, cameras, px)
    return names, px


def _letters(name: str) -> str:
    """Return a name without what people write in two ways: case, spaces, signs."""
    return "".join(filter(str.isalnum, name.casefold()))


def refuse_same_clicks(where: str, cameras: Sequence[str], px: Array) -> None:
    """Raise CalibrationError where two cameras have the very same clicks, px (points, cameras, 2), NaN if not seen."""
    for a, b in combinations(range(len(cameras)), 2):
        pairs = px[:, [a, b]][np.isfinite(px[:, [a, b]]).all(axis=(1, 2))]
        if len(pairs) >= _FEWEST_SAME and np.array_equal(pairs[:, 0], pairs[:, 1]):
            raise CalibrationError(
                f"{where}: cameras {cameras[a]} and {cameras[b]} have the same {len(pairs)} clicks; give each its own"
            )


def read_positions(path: Path) -> dict[str, Array]:
    """Read a table `joint,x_m,y_m,z_m`: joint -> (3,) world [m], NaN where blank; raises CalibrationError."""
    expected = "expected joint,x_m,y_m,z_m"
    names, columns, values = read_named_numbers(path, "joint", expected)
    if sorted(columns) != ["x_m", "y_m", "z_m"]:
        raise CalibrationError(f"{path.name}: found columns {', '.join(columns) or 'none'} beside joint; {expected}")
    return dict(zip(names, values[:, [columns.index(axis) for axis in ("x_m", "y_m", "z_m")]], strict=True))


def read_named_numbers(path: Path, key: str, expected: str) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
    """Read the names in column `key`, the other columns' names, and their numbers (rows, columns); NaN where blank.

    `expected` says in errors what the table should be. Raises CalibrationError, naming the row and column.
    """
    (_, header), *rows = read_csv(path, expected, CalibrationError) or [(0, [])]
    if key not in header or len(set(header)) < len(header) or not rows:
        header_text = ",".join(header)[:80]
        found = f"found header {header_text} and {len(rows)} rows" if header_text else "is empty"
        raise CalibrationError(f"{path.name}: {found}; {expected}, each once")
    key_column = header.index(key)
    columns = tuple(header[:key_column] + header[key_column + 1 :])
    names: list[str] = []
    values = np.full((len(rows), len(columns)), np.nan)
    for number, (line, row) in enumerate(rows):
        shown = f"{path.name}, row {line}: '{','.join(row)[:60]}'"
        if len(row) != len(header):
            commas = ", and decimals points" if len(row) > len(header) else ""
            raise CalibrationError(f"{shown} has {len(row)} values; it needs {len(header)}{commas}; {expected}")
        if not row[key_column]:
            raise CalibrationError(f"{shown} names no {key}; {expected}")
        if row[key_column] in names:
            earlier = rows[names.index(row[key_column])][0]
            raise CalibrationError(f"{shown}: {row[key_column]} stands in row {earlier} already; name each {key} once")
        names.append(row[key_column])
        cells = row[:key_column] + row[key_column + 1 :]
        where = f"{path.name}, row {line} ({key} '{row[key_column]}')"
        values[number] = [_number(cell, where, column) for cell, column in zip(cells, columns, strict=True)]
    return tuple(names), columns, values


def _number(cell: str, where: str, column: str) -> float:
    if not cell or cell.lower() == "nan":
        return np.nan
    try:
        value = float(cell)
    except ValueError:
        value = np.inf
    if not np.isfinite(value):
        unseen = ", or leave it blank if unseen" if column.endswith(("_u", "_v")) else ""
        raise CalibrationError(f"{where}, column {column}: '{cell}' is not a number; correct it{unseen}")
    return value
