"""Checks of recordings before calibration: the board's description, the clocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from airborne.calibration.diagnosis.boards import check_board_print
from airborne.calibration.diagnosis.clocks import check_counter, check_times
from airborne.calibration.initial.chaining import FEWEST_LENS_VIEWS, Views
from airborne.cameras.finding import Finding
from airborne.errors import CalibrationError
from airborne.types import Image


def check_board(views: Views, samples: Mapping[str, Sequence[Image]]) -> tuple[Finding, ...]:
    """Report what does not match the board's description, from a sample of each camera's images.

    Raises CalibrationError, with the reason, where a camera shows the board too rarely to fit its lens.
    """
    findings: list[Finding] = []
    for name, row in zip(views.cameras, views.detections, strict=True):
        own = check_board_print(views.board, samples[name], name)
        if own and sum(len(sighting.corner) > 0 for sighting in row) < FEWEST_LENS_VIEWS:
            raise CalibrationError(own[0].sentence)
        findings += own
    return tuple(findings)


def check_time_stamps(camera: str, rows: Sequence[Mapping[str, str]]) -> Iterator[Finding]:
    """Report what is wrong with a camera's rows of a table of time stamps, in the order of the moments."""
    yield from check_times(camera, np.array([float(row["frame_time"]) for row in rows]))
    numbers = [row.get("frame_index") or "" for row in rows]
    if all(number.isdigit() for number in numbers):
        yield from check_counter(camera, np.array([int(number) for number in numbers]))
