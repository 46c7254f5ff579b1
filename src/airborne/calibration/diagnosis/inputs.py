"""Checks of recordings before calibration: the board's description, the clocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from airborne.calibration.diagnosis.boards import check_board_print
from airborne.calibration.diagnosis.clocks import check_counter, check_times
from airborne.calibration.initial.chaining import FEWEST_LENS_VIEWS, Views
from airborne.calibration.sources.boards import Board, Memory
from airborne.cameras.finding import Finding
from airborne.errors import CalibrationError
from airborne.types import Image

# chosen: of a board's longer side; a sheet of A0, the largest that is printed, is 1.2 m long, and a playing card 0.09 m
_LEAST_SIDE_M, _MOST_SIDE_M = 0.08, 1.6


def check_board(
    views: Views, samples: Mapping[str, Sequence[Image]], memory: Memory | None = None
) -> tuple[Finding, ...]:
    """Report what does not match the board's description, from a sample of each camera's images.

    Raises CalibrationError, with the reason, where a camera shows the board too rarely to fit its lens.
    """
    findings = check_board_size(views.board)
    for name, row in zip(views.cameras, views.detections, strict=True):
        own = check_board_print(views.board, samples[name], name, memory)
        if own and sum(len(sighting.corner) > 0 for sighting in row) < FEWEST_LENS_VIEWS:
            raise CalibrationError(own[0].sentence)
        findings += own
    return tuple(findings)


def check_board_size(board: Board) -> list[Finding]:
    """Report a board whose squares come out at a size that nobody holds."""
    sides_m = [(n + 1) * board.square_m for n in board.inner_size]
    if _LEAST_SIDE_M <= max(sides_m) <= _MOST_SIDE_M:
        return []
    across, down = (f"{side_m:.2g}" for side_m in sides_m)
    return [
        Finding(
            kind="board",
            what=f"the board is {across} m × {down} m by its file, squares of {board.square_m:.3g} m",
            advice="measure a square of the print: all lengths of the calibration follow from it, in metres",
        )
    ]


def check_time_stamps(camera: str, rows: Sequence[Mapping[str, str]]) -> Iterator[Finding]:
    """Report what is wrong with a camera's rows of a table of time stamps, in the order of the moments."""
    yield from check_times(camera, np.array([float(row["frame_time"]) for row in rows]))
    numbers = [row.get("frame_index") or "" for row in rows]
    if all(number.isdigit() for number in numbers):
        yield from check_counter(camera, np.array([int(number) for number in numbers]))
