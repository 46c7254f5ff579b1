"""Checks of clocks and counters: restarts, repeats, lost frames; and of rolling shutters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.finding import Finding, join_names
from airborne.geometry.robust import SD_OF_MEDIAN_DEVIATION
from airborne.types import Array

_SAME_TIME = 0.1  # of a period: times closer than this are equal
_GAP = 1.5  # periods: a larger step is a lost frame
_NAMED = 3  # frames listed by number; of more only how many
_FEWEST_TIMES = 5  # time stamps that determine a period
_READOUT_S, _READOUT_SDS, _READOUT_PX = (
    0.002,
    5.0,
    0.3,
)  # least readout time, significance and displacement that are reported
_MOST_READOUT_S = 0.1  # longer than any image period of video: another error


def check_times(camera: str, times_s: Array) -> list[Finding]:
    """Report where a camera's time stamps (n,) [s], in the order of its frames, go back, repeat or skip one."""
    times_s = np.asarray(times_s, float)
    if len(times_s) < _FEWEST_TIMES:
        return []
    return list(_check_steps(camera, times_s, "time stamps", period=None))


def check_counter(camera: str, counts: NDArray[np.integer]) -> list[Finding]:
    """Report where a camera's own frame counter (n,), in the order of its frames, rolls over, repeats or jumps."""
    if len(counts) < _FEWEST_TIMES:
        return []
    return list(_check_steps(camera, counts.astype(float), "image numbers", period=1.0))


def check_image_counts(n_pictures: Mapping[str, int], n_least: int = 1) -> list[Finding]:
    """Report videos with another number of frames than most; n_least: the least difference that counts."""
    values, how_often = np.unique(list(n_pictures.values()), return_counts=True)
    if len(values) < 2:
        return []
    most_common = int(values[np.argmax(how_often)])
    odd = {name: n for name, n in n_pictures.items() if abs(n - most_common) >= n_least}
    if not odd:
        return []
    description = join_names([f"{name} has {n}" for name, n in odd.items()])
    others = join_names([name for name in n_pictures if name not in odd])
    return [
        Finding(
            kind="clock",
            what=f"{description} images, {others} {most_common}",
            advice=(
                "started late, ended early or lost some; without time stamps that is not known, so compare an event "
                "that all cameras see near the end (airborne sync)"
            ),
            cameras=tuple(odd),
        )
    ]


def _check_steps(camera: str, values: Array, what: str, *, period: float | None) -> Iterator[Finding]:
    steps = np.diff(values)
    period = period or (float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0)
    if period <= 0:
        yield _finding(camera, f"its {what} never go forward", "they are no times; leave them out and give the rate")
        return
    backward, repeated = (
        np.flatnonzero(steps < -_SAME_TIME * period),
        np.flatnonzero(np.abs(steps) <= _SAME_TIME * period),
    )
    gaps = np.flatnonzero(steps > _GAP * period)
    if len(backward):
        yield _finding(
            camera,
            f"its {what} fall from {values[backward[0]]:g} to {values[backward[0] + 1]:g} {_at(backward)}",
            "a counter rolled over or the camera started anew; let it run on from there, or cut the recording there",
        )
    if len(repeated):
        yield _finding(
            camera,
            f"its {what} stand still {_at(repeated)}",
            "images were stored twice; leave the repeats out",
        )
    if len(gaps):
        lost = int(np.sum(np.round(steps[gaps] / period) - 1))
        yield _finding(
            camera,
            f"{lost} image{'s are' if lost != 1 else ' is'} missing by its {what}, {_at(gaps)}",
            "the camera lost them; go by the time stamps, do not count images",
        )


def _at(rows: NDArray[np.integer]) -> str:
    """Return a phrase: after which frames, counted from 0."""
    listed = ", ".join(str(row) for row in rows[:_NAMED])
    more = f" and {len(rows) - _NAMED} more" if len(rows) > _NAMED else ""
    return f"after image{'s' * (len(rows) > 1)} {listed}{more}"


def _finding(camera: str, what: str, advice: str) -> Finding:
    return Finding(kind="clock", what=f"{camera}: {what}", advice=advice, cameras=(camera,))


def check_rolling_shutter(
    camera: str, residual_px: Array, velocity_px_per_s: Array, *, row_px: Array, height_px: int
) -> list[Finding]:
    """Report a rolling shutter: moving points are displaced in proportion to their row.

    residual_px (n, 2), measured minus projected; velocity (n, 2) of the image points [px/s]; row_px (n,). Robust fit of
    `residual = velocity (offset + readout (row / height - 1/2))`.
    """
    is_valid = np.isfinite(np.column_stack([residual_px, velocity_px_per_s, row_px])).all(axis=1)
    r, v = residual_px[is_valid], velocity_px_per_s[is_valid]
    if is_valid.sum() < 10 * _FEWEST_TIMES or not v.any():
        return []
    relative_row = row_px[is_valid] / height_px - 0.5
    A, b = np.column_stack([v.ravel(), (v * relative_row[:, None]).ravel()]), r.ravel()
    weights = np.ones(len(b))
    for _ in range(10):
        root = np.sqrt(weights)
        x = np.linalg.lstsq(A * root[:, None], b * root, rcond=None)[0]
        residual = b - A @ x
        scale = max(SD_OF_MEDIAN_DEVIATION * float(np.median(np.abs(residual))), 1e-9)
        weights = 1 / (1 + (residual / (2 * scale)) ** 2)
    information = A.T @ (weights[:, None] * A)
    if np.linalg.cond(information) > 1e10:
        return []
    sd = scale * float(np.sqrt(np.linalg.inv(information)[1, 1]))
    shift_px = x[1] / 2 * float(np.median(np.linalg.norm(v, axis=1)))
    if not (_READOUT_S < x[1] < _MOST_READOUT_S and x[1] > _READOUT_SDS * sd and shift_px > _READOUT_PX):
        return []
    return [
        Finding(
            kind="rolling shutter",
            what=(
                f"{camera} reads its rows over {x[1] * 1e3:.0f} ms (sd {sd * 1e3:.0f}): moving points are displaced by "
                f"{shift_px:.1f} px at the image's upper and lower edge"
            ),
            advice="calibrate with slow movements; fast ones are measured late in the lower half of the image",
            cameras=(camera,),
        )
    ]
