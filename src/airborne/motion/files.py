"""motion.csv: one row per finished frame, written during a run, read back bit for bit.

A body with joints has its full covariance in covariance.bin beside it.
"""

from __future__ import annotations

import csv
import math
import os
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose
from airborne.errors import ResultError
from airborne.io.writing import explain_full_disk
from airborne.motion.covariance_file import (
    COVARIANCE_FILE,
    LASTING_FILE,
    CovarianceWriter,
    read_covariances,
    write_covariances,
)
from airborne.motion.frame_file import read_frame_deviations, write_frame_deviations
from airborne.motion.motion import Motion, rigid_transform
from airborne.motion.tables import cell, motion_columns
from airborne.tracking import Doubt, Estimate, Status

_UPPER = np.triu_indices(6)  # of the covariance of position and rotation
_COVARIANCE = [f"cov_{i}{j}" for i, j in zip(*_UPPER, strict=True)]
_TIME = "time_exact"
_ROTATION = [f"r{i}{j}" for i in range(3) for j in range(3)]


class MotionWriter:
    """Appends estimates to motion.csv; each row is on disk before the next frame begins.

    A killed run leaves whole rows and at most one torn last line, which `read_estimates` drops. For a body with joints
    the full covariance goes to covariance.bin in the same folder, before the row does.
    """

    def __init__(self, path: Path, joints: tuple[str, ...] = (), *, resume: bool = False) -> None:
        """Start a new file, or with `resume` keep the finished rows and cut off a torn last line.

        `joints` are the names of the body's segments after the root. Raises ResultError if the file to resume
        holds the motion of another body.
        """
        finished = _whole_lines(path) if resume and path.exists() else b""
        file_joints, estimates = _parse(path) if finished else (joints, [])
        if file_joints != joints:
            listed = ", ".join(joints) or "none"
            raise ResultError(f"{path} was written for another body; joints here: {listed}; start in a new folder")
        self._path, self._joints, self._covariances = path, joints, None
        if joints:
            past = Motion.collect(estimates, joints).covariance
            self._covariances = CovarianceWriter(path.with_name(COVARIANCE_FILE), list(past), size=past.shape[-1])
        self._file = path.open("r+b" if finished else "wb")
        self._file.truncate(len(finished))
        self._file.seek(len(finished))
        if not finished:
            self._write_line(_header(joints))

    def __enter__(self) -> MotionWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        if self._covariances is not None:
            self._covariances.close()

    def append(self, estimate: Estimate) -> None:
        """Write one frame and wait until it is on disk."""
        motion = Motion.collect([estimate], self._joints)
        if self._covariances is not None:
            self._covariances.append(motion.covariance[0])
        (cells,) = _cells(motion, [str(estimate.time_s)])
        self._write_line(cells)

    def _write_line(self, cells: list[str]) -> None:
        with explain_full_disk(self._path):
            self._file.write((",".join(cells) + "\n").encode())
            self._file.flush()
            os.fsync(self._file.fileno())


def read_estimates(path: Path) -> list[Estimate]:
    """Read the estimates of motion.csv, with exactly the floats and times that were written.

    A torn last line is dropped. Covariances are made symmetric from their upper triangles; the joints' part is NaN
    without covariance.bin beside the file. Raises ResultError in one line for a file that is missing or no motion.csv,
    and for the covariance.bin of another run. They come in the order of time, whatever that of the rows.
    """
    return sorted(_parse(path)[1], key=lambda estimate: estimate.index)


def read_motion(path: Path) -> Motion:
    """Read motion.csv as a `Motion`, with the lasting errors beside it; the rules are those of `read_estimates`."""
    joints, estimates = _parse(path)
    lasting = read_covariances(path.with_name(LASTING_FILE), len(estimates), size=6)
    motion = Motion.collect(sorted(estimates, key=lambda estimate: estimate.index), joints)
    motion = replace(motion, by_frame=read_frame_deviations(path, len(motion), len(joints)))
    return motion if np.isnan(lasting).any() else replace(motion, lasting=lasting)


def revise_motion(path: Path, motion: Motion) -> None:
    """Write a run's motion as its end leaves it, in the place of that which was written frame by frame.

    The motion is of the same frames, in the order of the rows. Lasting errors go beside motion.csv.
    """
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    exact = header.split(",").index(_TIME)
    lines = [header, *map(",".join, _cells(motion, [line.split(",")[exact] for line in rows]))]
    if motion.lasting is not None:
        write_covariances(path.with_name(LASTING_FILE), motion.lasting)
    write_frame_deviations(path, motion.by_frame)
    unfinished = path.with_name(path.name + ".part")
    unfinished.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    if motion.joints:
        write_covariances(path.with_name(COVARIANCE_FILE), motion.covariance)
    unfinished.replace(path)


def copy_motion(path: Path, to: Path) -> None:
    """Copy a motion.csv with its covariance.bin; only after all of them is the copy there."""
    covariance, unfinished = path.with_name(COVARIANCE_FILE), to.with_name(to.name + ".part")
    if covariance.is_file():
        shutil.copyfile(covariance, to.with_name(COVARIANCE_FILE))
    shutil.copyfile(path, unfinished)
    unfinished.replace(to)


def remove_motion(path: Path) -> None:
    """Remove a motion.csv with its covariance.bin."""
    for each in (path, path.with_name(COVARIANCE_FILE)):
        each.unlink(missing_ok=True)


def drop_rows(path: Path, is_dropped: Callable[[int], bool]) -> None:
    """Take the rows of some frames out of motion.csv and covariance.bin; a run that is resumed tracks them again."""
    estimates = _parse(path)[1]
    _rewrite(path, [row for row, estimate in enumerate(estimates) if not is_dropped(estimate.index)])


def sort_rows(path: Path) -> None:
    """Bring the rows of motion.csv and covariance.bin into the order of time; those tracked again come last."""
    index = [estimate.index for estimate in _parse(path)[1]]
    if index != sorted(index):
        _rewrite(path, sorted(range(len(index)), key=index.__getitem__))


def _rewrite(path: Path, rows: Sequence[int]) -> None:
    """Keep some rows, in this order."""
    (joints, estimates), lines = _parse(path), _whole_lines(path).splitlines(keepends=True)
    covariance = Motion.collect([estimates[row] for row in rows], joints).covariance
    unfinished = path.with_name(path.name + ".part")
    unfinished.write_bytes(b"".join([lines[0], *(lines[1 + row] for row in rows)]))
    if joints:
        write_covariances(path.with_name(COVARIANCE_FILE), covariance)
    unfinished.replace(path)


def _cells(motion: Motion, exact_times: Sequence[str]) -> Iterator[list[str]]:
    """Yield the cells of each row of motion.csv."""
    columns = list(motion_columns(motion).values())
    for row, time in enumerate(exact_times):
        covariance, R, angles = (each[row] for each in (motion.covariance, motion.R, motion.joint_angles))
        numbers = covariance[_UPPER], R.ravel(), angles.ravel()
        upper, rotation, joints = (list(map(cell, each)) for each in numbers)
        yield [*(cell(column[row]) for column in columns), *upper, time, *rotation, *joints]


def _header(joints: tuple[str, ...]) -> list[str]:
    angles = [f"{joint}_{axis}_rad" for joint in joints for axis in "xyz"]
    return [*motion_columns(Motion.collect([])), *_COVARIANCE, _TIME, *_ROTATION, *angles]


def _whole_lines(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ResultError(f"{path} cannot be read ({error.strerror}); expected the motion.csv of a run") from error
    return data[: data.rfind(b"\n") + 1]


def _parse(path: Path) -> tuple[tuple[str, ...], list[Estimate]]:
    data = _whole_lines(path)
    try:
        rows = list(csv.reader(data.decode().splitlines()))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"{path} is not a text table ({error}); expected the motion.csv of a run") from error
    joints = joints_in_header(path, rows[0] if rows else [])
    header, estimates = _header(joints), []
    covariances = read_covariances(
        path.with_name(COVARIANCE_FILE), len(rows[1:]) if joints else 0, size=6 + 3 * len(joints)
    )
    seen: set[int] = set()
    for number, cells in enumerate(rows[1:], start=2):
        try:
            covariance = covariances[number - 2] if joints else None
            estimate = _estimate(dict(zip(header, cells, strict=True)), joints, covariance)
            if estimate.index in seen:
                raise ValueError(f"frame {estimate.index} a second time, expected each once")
            seen.add(estimate.index)
            estimates.append(estimate)
        except (ValueError, ZeroDivisionError) as error:
            reason = f"{len(cells)} cells, expected {len(header)}" if len(cells) != len(header) else error
            raise ResultError(f"{path} line {number}: {reason}; correct the line or track again") from error
    return joints, estimates


def joints_in_header(path: Path, header: list[str]) -> tuple[str, ...]:
    """Return the joints whose angles a motion.csv holds, by its header. Raises ResultError for another table."""
    fixed = _header(())
    joints = tuple(name.removesuffix("_x_rad") for name in header[len(fixed) :: 3])
    if header != _header(joints):
        missing = [name for name in fixed if name not in header]
        problem = f"has no column {', '.join(missing[:3])}" if missing else "has its columns in another order"
        raise ResultError(f"{path} {problem if header else 'is empty'}; expected the motion.csv of a run; track again")
    return joints


def parse_line(path: Path, line: bytes, joints: tuple[str, ...]) -> Estimate:
    """Return the estimate of one line of a motion.csv, without the covariances of joints. Raises ResultError."""
    cells = line.decode(errors="replace").rstrip("\r\n").split(",")
    try:
        return _estimate(dict(zip(_header(joints), cells, strict=True)), joints, None)
    except (ValueError, ZeroDivisionError) as error:
        raise ResultError(f"{path}: the row of frame {cells[0][:20]}: {error}; track again") from None


def _estimate(row: dict[str, str], joints: tuple[str, ...], full: NDArray[np.float64] | None) -> Estimate:
    """Make an estimate from a row of motion.csv and, for a body with joints, its row of covariance.bin."""
    if row["status"] not in tuple(Status):
        raise ValueError(f"status is '{row['status'][:40]}', expected {', '.join(Status)}")
    status = Status(row["status"])
    position = _numbers(row, ["x_m", "y_m", "z_m"])
    R = _numbers(row, _ROTATION).reshape(3, 3)
    upper = _numbers(row, _COVARIANCE)
    covariance = np.empty((6, 6))
    covariance[_UPPER] = covariance.T[_UPPER] = upper
    if full is not None:
        if not np.isnan(full).all() and not np.array_equal(full[:6, :6], covariance, equal_nan=True):
            raise ValueError(f"{COVARIANCE_FILE} holds another covariance, so it belongs to another run; remove it")
        full[:6, :6] = covariance
        covariance = full
    pose = None
    if status is not Status.LOST:
        if not (np.abs(R).max() < 2 and np.abs(R.T @ R - np.eye(3)).max() < 1e-6):
            raise ValueError(f"r00..r22 of a {status} frame are not a rotation")
        if not np.isfinite(position).all():
            raise ValueError(f"a {status} frame has no position")
        angles = _numbers(row, list(row)[-3 * len(joints) :] if joints else []).reshape(-1, 3)
        pose = Pose(world_from_root=rigid_transform(R, position), joint_angles=angles)
    return Estimate(
        index=_whole_number(row, "frame"),
        time_s=_exact_fraction(row[_TIME]),
        status=status,
        score=_number(row["score"]),
        pose=pose,
        covariance=None if np.isnan(covariance).all() else covariance,
        n_views=_whole_number(row, "n_views"),
        doubts=tuple(map(Doubt, _names(row, "doubts", tuple(Doubt)))),
        uncertain_joints=tuple(map(joints.index, _names(row, "uncertain_joints", joints))),
    )


def _names(row: dict[str, str], column: str, known: Sequence[str]) -> list[str]:
    names = row[column].split("/") if row[column] else []
    unknown = next((name for name in names if name not in known), None)
    if unknown is not None:
        raise ValueError(f"{column} names '{unknown[:40]}', expected some of {', '.join(known) or 'none'}")
    return names


def _whole_number(row: dict[str, str], column: str) -> int:
    if not re.fullmatch(r"-?[0-9]{1,15}", row[column]):
        raise ValueError(f"{column} is '{row[column][:40]}', expected a whole number")
    return int(row[column])


def _exact_fraction(text: str) -> Fraction:
    if not re.fullmatch(r"-?[0-9]{1,40}(/[0-9]{1,40})?", text):  # no exponents: 1e999999999 would take all memory
        raise ValueError(f"time_exact is '{text[:40]}', expected a fraction such as 1001/60000")
    return Fraction(text)


def _numbers(row: dict[str, str], names: list[str]) -> NDArray[np.float64]:
    return np.array([_number(row[name]) for name in names])


def _number(text: str) -> float:
    return float(text) if text else math.nan
