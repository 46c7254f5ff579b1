"""The result of synchronisation: offsets and drifts of cameras."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airborne.types import Array, Progress
from airborne.video import Recording


@dataclass(frozen=True, slots=True, eq=False)
class Offsets:
    """What to add to the times of each camera's images, `offset + drift * time`; NaN where unknown."""

    names: tuple[str, ...]
    offset_s: Array  # (c,)
    offset_sd_s: Array  # (c,)
    drift: Array  # (c,) [s/s]; zeros where not estimated
    drift_sd: Array  # (c,)
    how: str  # by which method, of what data
    notes: tuple[str, ...] = ()  # what the user should know, one line each

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers for JSON."""
        rows = zip(self.names, self.offset_s, self.offset_sd_s, self.drift, self.drift_sd, strict=True)
        keys = ("name", "offset_s", "offset_sd_s", "drift_ppm", "drift_sd_ppm")
        cameras = [
            dict(zip(keys, (name, float(o), float(sd), 1e6 * float(d), 1e6 * float(d_sd)), strict=True))
            for name, o, sd, d, d_sd in rows
        ]
        return {"how": self.how, "cameras": cameras, "notes": list(self.notes)}

    def describe(self) -> str:
        """Describe the method, then each camera in a line."""
        lines = [self.how]
        for name, offset, sd, drift, drift_sd in zip(
            self.names, self.offset_s, self.offset_sd_s, self.drift, self.drift_sd, strict=True
        ):
            line = f"{name}: offset {1000 * offset:+.2f} ms (sd {1000 * sd:.2f})"
            lines.append(line + (f", drift {1e6 * drift:+.1f} ppm (sd {1e6 * drift_sd:.1f})" if drift else ""))
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])


def with_offsets(recording: Recording, offset_s: Array, drift: Array) -> Recording:
    """Return a recording whose cameras have these offsets (c,) [s] and drifts (c,) [s/s]."""
    rows = zip(recording.sources, offset_s, drift, strict=True)
    sources = [
        replace(source, offset_s=round(float(offset), 9), drift_ppm=round(1e6 * float(rate), 6))
        for source, offset, rate in rows
    ]
    return replace(recording, sources=tuple(sources))


def fit_line(time_s: Array, offset_s: Array, sd_s: Array, *, with_drift: bool) -> tuple[float, float, float, float]:
    """Fit `offset + drift * time` to offsets (n,) measured at times (n,): offset, its sd, drift, its sd.

    Scatter beyond the stated sds (n,) widens the result. Without drift, or from a single moment, drift is 0.
    """
    columns = [np.ones(len(time_s)), time_s] if with_drift and np.ptp(time_s) > 0 else [np.ones(len(time_s))]
    design = np.stack(columns, axis=1)
    weighted = design / sd_s[:, None]
    inverse = np.linalg.inv(weighted.T @ weighted)
    solution = inverse @ (weighted.T @ (offset_s / sd_s))
    spare = len(time_s) - len(solution)
    chi2 = float(np.sum(((offset_s - design @ solution) / sd_s) ** 2))
    sd = np.sqrt(np.diag(inverse) * max(1.0, chi2 / spare if spare else 1.0))
    return float(solution[0]), float(sd[0]), *((float(solution[1]), float(sd[1])) if len(solution) > 1 else (0.0, 0.0))


def image_counter(progress: Progress | None) -> Callable[[], None]:
    """Return a function to call after every image, which reports the number of calls."""
    n = 0

    def count() -> None:
        nonlocal n
        n += 1
        if progress is not None:
            progress(n, None)

    return count
