"""Tables of numbers under a header line, as truth and digitised points come."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.errors import ResultError
from airborne.reading import read_csv

_LARGEST = 1e15  # of any number in a table: a whole number is exact up to here


@dataclass(frozen=True, slots=True)
class Table:
    """A comma-separated file: its column names, and its lines as text."""

    path: Path
    names: list[str]
    lines: list[list[str]]

    def numbers(self, names: list[str]) -> NDArray[np.float64]:
        """Return the named columns as numbers (lines, names), blank cells as NaN; ResultError for anything else."""
        columns = [self.names.index(name) for name in names]
        values = np.full((len(self.lines), len(names)), np.nan)
        for row, cells in enumerate(self.lines):
            if len(cells) != len(self.names):
                raise ResultError(
                    f"{self.path} line {row + 2} has {len(cells)} cells, expected {len(self.names)}; mend it"
                )
            for k, (name, column) in enumerate(zip(names, columns, strict=True)):
                text = cells[column].strip()
                try:
                    values[row, k] = float(text) if text else np.nan
                except ValueError:
                    values[row, k] = np.inf
                if not abs(values[row, k]) <= _LARGEST and not np.isnan(values[row, k]):
                    raise ResultError(
                        f"{self.path} line {row + 2}: {name[:60]} is '{text[:60]}', expected a number; mend it"
                    )
        return values

    def whole_numbers(self, name: str) -> NDArray[np.int64]:
        """Return one column as whole numbers (lines,); ResultError for anything else."""
        values = self.numbers([name])[:, 0]
        for row, value in enumerate(values):
            if value != np.round(value):
                raise ResultError(f"{self.path} line {row + 2}: {name} must be a whole number, as in 0, 1, 2; mend it")
        return values.astype(np.int64)


def read_table(path: Path, expected: str) -> Table:
    """Read a table; `expected` says in the error what the file should have been. Raises ResultError."""
    rows = [row for _, row in read_csv(path, f"expected {expected}", ResultError)]
    if len(rows) < 2:
        raise ResultError(f"{path} has no lines of numbers; expected {expected}")
    return Table(path, rows[0], rows[1:])
