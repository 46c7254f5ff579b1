"""Tables of numbers under a header line, such as truth and digitised points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.io.text import read_csv

_LARGEST = 1e15  # magnitude of any number in a table: whole numbers are exact up to here


@dataclass(frozen=True, slots=True)
class Table:
    """A comma-separated file: column names, lines as text, and their line numbers."""

    path: Path
    names: list[str]
    lines: list[list[str]]
    line_numbers: list[int]

    def numbers(self, names: list[str], *, or_infinite: bool = False) -> NDArray[np.float64]:
        """Return the named columns as numbers (lines, names), blank cells as NaN; ResultError for anything else.

        Where cells may be infinite, as standard deviations are, that is written `inf`.
        """
        columns = [self.names.index(name) for name in names]
        values = np.full((len(self.lines), len(names)), np.nan)
        for row, cells in enumerate(self.lines):
            where = f"{self.path} line {self.line_numbers[row]}"
            if len(cells) != len(self.names):
                raise ResultError(f"{where} has {len(cells)} cells, expected {len(self.names)}; correct it")
            for k, (name, column) in enumerate(zip(names, columns, strict=True)):
                text = cells[column].strip()
                if or_infinite and text == "inf":
                    values[row, k] = np.inf
                    continue
                try:
                    values[row, k] = float(text) if text else np.nan
                except ValueError:
                    values[row, k] = np.inf
                if not abs(values[row, k]) <= _LARGEST and not np.isnan(values[row, k]):
                    raise ResultError(f"{where}: {name[:60]} is '{text[:60]}', expected a number; correct it")
        return values

    def times_s(self) -> NDArray[np.float64]:
        """Return the column time_s (lines,); ResultError where a cell is blank."""
        values = self.numbers(["time_s"])[:, 0]
        for line, value in zip(self.line_numbers, values, strict=True):
            if np.isnan(value):
                raise ResultError(f"{self.path} line {line} has no time_s; every line needs one, in seconds")
        return values

    def whole_numbers(self, name: str) -> NDArray[np.int64]:
        """Return one column as whole numbers (lines,); ResultError for anything else."""
        values = self.numbers([name])[:, 0]
        for line, value in zip(self.line_numbers, values, strict=True):
            if value != np.round(value):
                raise ResultError(f"{self.path} line {line}: {name} must be a whole number, as in 0, 1, 2; correct it")
        return values.astype(np.int64)


def read_table(path: Path, expected: str) -> Table:
    """Read a table; `expected` describes the right file for the error message. Raises ResultError."""
    rows = read_csv(path, f"expected {expected}", ResultError)
    if len(rows) < 2:
        raise ResultError(f"{path} has no lines of numbers; expected {expected}")
    (_, names), *others = rows
    return Table(path, names, [cells for _, cells in others], [line for line, _ in others])
