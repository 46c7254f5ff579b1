"""motion.csv of a run that is looked at while it grows: what curves need of all frames, and the pose of any.

Reading all poses and covariances of 200,000 frames takes gigabytes; this takes 90 bytes a frame.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose
from airborne.errors import ResultError
from airborne.motion.files import joints_in_header, parse_line
from airborne.tracking import Estimate, Status
from airborne.types import Array

_TIME, _STATUS, _POSITION, _SD = 1, 2, (4, 5, 6), (11, 12, 13)  # columns of motion.csv
_NUMBERS = (_TIME, *_POSITION, *_SD)


@dataclass(frozen=True, slots=True, eq=False)
class MotionRows:
    """The rows of a motion.csv, in the order of its frames."""

    path: Path
    joints: tuple[str, ...]
    index: NDArray[np.int64]  # (n,) frames, ascending
    status: NDArray[np.str_]  # (n,)
    numbers: Array  # (n, 7): time [s], position [m] and its standard deviations [m], NaN where lost
    starts: NDArray[np.int64]  # (n,) where each row begins in the file [bytes]
    end: int  # of the last whole row [bytes]
    newest: int | None  # the frame of that row
    file: tuple[int, bytes]  # its inode and that row, by which it is known again

    def __len__(self) -> int:
        return len(self.index)

    @property
    def time_s(self) -> Array:
        """Times: (n,)."""
        return self.numbers[:, 0]

    @property
    def position(self) -> Array:
        """Positions of the root: (n, 3) [m]."""
        return self.numbers[:, 1:4]

    @property
    def position_sd(self) -> Array:
        """Their standard deviations: (n, 3) [m]."""
        return self.numbers[:, 4:]

    def row(self, frame: int) -> int | None:
        """Return the row of a frame."""
        row = int(np.searchsorted(self.index, frame))
        return row if row < len(self.index) and self.index[row] == frame else None

    def estimate(self, row: int) -> Estimate:
        """Read a row, without the covariances of joints. Raises ResultError."""
        with self.path.open("rb") as file:
            file.seek(int(self.starts[row]))
            return parse_line(self.path, file.readline(), self.joints)

    def pose(self, frame: int) -> Pose | None:
        """Read the pose of a frame; None where it has none. Raises ResultError."""
        row = self.row(frame)
        return None if row is None else self.estimate(row).pose


def read_rows(path: Path, known: MotionRows | None = None) -> MotionRows:
    """Read the whole rows of a motion.csv; those that are `known` of the same file are not read again.

    Raises ResultError for a file that is missing, or is no motion.csv.
    """
    try:
        file = path.open("rb")
    except OSError as error:
        raise ResultError(f"{path} cannot be read ({error.strerror}); expected the motion.csv of a run") from error
    with file:
        inode, header = path.stat().st_ino, file.readline()
        joints = joints_in_header(path, header.decode(errors="replace").rstrip("\r\n").split(","))
        if known is not None and known.joints == joints and known.file[0] == inode:
            file.seek(known.end - len(known.file[1]))
            known = known if file.read(len(known.file[1])) == known.file[1] else None
        else:
            known = None
        begin = len(header) if known is None else known.end
        file.seek(begin)
        frames, starts, numbers, statuses, last = array("q"), array("q"), array("d"), [], header
        for last in _whole_lines(file):
            cells = last.split(b",", _SD[-1] + 1)
            try:
                frames.append(int(cells[0]))
                statuses.append(Status(cells[_STATUS].decode()).value)
                numbers.extend(float(cells[k]) if cells[k] else math.nan for k in _NUMBERS)
                if not math.isfinite(numbers[-len(_NUMBERS)]):
                    raise ValueError("its time is no number")
            except (ValueError, IndexError, OverflowError) as error:
                raise ResultError(f"{path}: the row of frame {cells[0][:20]!r}: {error}; track again") from None
            starts.append(begin)
            begin += len(last)
    index, places, status = np.array(frames, np.int64), np.array(starts, np.int64), np.array(statuses, np.str_)
    values = np.array(numbers).reshape(-1, len(_NUMBERS))
    if known is not None:
        if not len(index):
            return known
        index, places = np.append(known.index, index), np.append(known.starts, places)
        status, values = np.append(known.status, status), np.concatenate([known.numbers, values])
    newest, order = int(index[-1]) if len(index) else None, np.argsort(index, kind="stable")
    return MotionRows(
        path, joints, index[order], status[order], values[order], places[order], begin, newest, (inode, last)
    )


def _whole_lines(file: Iterator[bytes]) -> Iterator[bytes]:
    """Yield lines up to a torn last one."""
    return (line for line in file if line.endswith(b"\n"))
