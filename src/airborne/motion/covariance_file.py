"""covariance.bin: the full covariance of a body with joints, beside the motion.csv that holds the root's.

Rows of little-endian 64-bit floats, one per row of motion.csv: the upper triangle, row by row, of the matrix
(6 + 3 joints, 6 + 3 joints) of `Estimate`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airborne.errors import ResultError
from airborne.io.writing import explain_full_disk
from airborne.types import Array

COVARIANCE_FILE = "covariance.bin"
LASTING_FILE = "lasting.bin"  # the same of the root's errors that last all run long (6, 6), of any body
FLOAT = np.dtype("<f8")


class CovarianceWriter:
    """Appends covariances; each is on disk before `append` returns."""

    def __init__(self, path: Path, covariances: Sequence[Array], *, size: int) -> None:
        """Open a file for the given covariances (size, size); rows that it already has stay as they are."""
        n_finished = min(len(covariances), path.stat().st_size // _row_bytes(size)) if path.is_file() else 0
        self._path, self._upper = path, np.triu_indices(size)
        self._file = path.open("r+b" if n_finished else "wb")
        self._file.truncate(n_finished * _row_bytes(size))
        self._file.seek(0, os.SEEK_END)
        for covariance in covariances[n_finished:]:
            self.append(covariance)

    def append(self, covariance: Array) -> None:
        """Write one covariance (size, size) and wait until it is on disk."""
        with explain_full_disk(self._path):
            self._file.write(covariance[self._upper].astype(FLOAT).tobytes())
            self._file.flush()
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def write_covariances(path: Path, covariances: Array) -> None:
    """Write covariances (n, size, size) at once; a file that is there stays whole until they are."""
    rows, columns = np.triu_indices(covariances.shape[-1])
    write_rows(path, covariances[:, rows, columns])


def write_rows(path: Path, rows: Array) -> None:
    """Write rows of numbers (n, k) at once; a file that is there stays whole until they are."""
    unfinished = path.with_name(path.name + ".part")
    unfinished.write_bytes(rows.astype(FLOAT).tobytes())
    unfinished.replace(path)


def read_covariances(path: Path, n: int, *, size: int, first: int = 0) -> Array:
    """Read n covariances (n, size, size) from the `first` on.

    Rows missing from the file are NaN, all of them without a file. Raises ResultError if the file exists and cannot be
    read.
    """
    covariances, upper = np.full((n, size, size), np.nan), np.triu_indices(size)
    if not path.is_file():
        return covariances
    try:
        with path.open("rb") as file:
            file.seek(first * _row_bytes(size))
            data = file.read(n * _row_bytes(size))
    except OSError as error:
        raise ResultError(f"{path} cannot be read ({error.strerror}); repair it, or remove it to go without") from None
    n_whole = len(data) // _row_bytes(size)
    rows = np.frombuffer(data, FLOAT, n_whole * len(upper[0])).reshape(n_whole, len(upper[0]))
    for covariance, row in zip(covariances, rows, strict=False):
        covariance[upper] = covariance.T[upper] = row
    return covariances


def _row_bytes(size: int) -> int:
    return FLOAT.itemsize * (size * (size + 1) // 2)
