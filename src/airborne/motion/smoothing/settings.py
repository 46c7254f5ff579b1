"""A smoothing method and its settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from airborne.errors import ResultError
from airborne.motion.smoothing.butterworth import butterworth_smoother
from airborne.motion.smoothing.kalman import kalman_smoother
from airborne.motion.smoothing.segments import Smoother
from airborne.motion.smoothing.splines import spline_smoother

_LONGEST_FILL_S = 0.5  # of a gap that may be filled
_DESCRIPTIONS = {
    "butterworth": "zero-lag Butterworth low-pass, second order forward and back, -3 dB of both at {cutoff:g} Hz",
    "spline": "cubic smoothing spline by generalised cross-validation, weighted by 1 / variance",
    "kalman": "Kalman smoother with white-noise jerk, its density by maximum likelihood, and the run's covariances",
}
_FILLED_BY = {
    "butterworth": "a cubic spline through the known frames",
    "spline": "the spline",
    "kalman": "the smoother's own model",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Smoothing:
    """A smoothing method and its settings. Gaps up to `fill_s` [s] are filled; none by default.

    Raises ResultError for gaps too long to fill, and for a cut-off with another method.
    """

    method: Literal["butterworth", "spline", "kalman"]
    cutoff_hz: float | None = None  # of the Butterworth filter; None if still to be chosen
    resample_hz: float | None = None  # of the Butterworth filter, for uneven times
    fill_s: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.fill_s <= _LONGEST_FILL_S:
            raise ResultError(
                f"gaps of {self.fill_s:g} s cannot be filled; give 0 to {_LONGEST_FILL_S:g} s: "
                "the motion in between is unknown"
            )
        if self.method != "butterworth" and not (self.cutoff_hz is self.resample_hz is None):
            raise ResultError(
                f"cut-off and resampling are a Butterworth filter's (--butterworth); leave them out of {self.method}"
            )

    def smoother(self, *, has_joints: bool) -> Smoother:
        """Return the smoother of one stretch, of a body with joints or without: errors of one with joints are slow.

        Raises ResultError for a Butterworth filter without a cut-off.
        """
        if self.method == "butterworth":
            if self.cutoff_hz is None:
                raise ResultError("a Butterworth filter needs a cut-off in Hz; give one, such as 6")
            smoother = partial(butterworth_smoother, cutoff_hz=self.cutoff_hz, resample_hz=self.resample_hz)
        else:
            smoother = spline_smoother if self.method == "spline" else kalman_smoother
        return partial(smoother, are_errors_slow=has_joints)

    def history(self, boundaries_s: Sequence[float] | Mapping[str, Sequence[float]]) -> list[str]:
        """Describe what was done, one operation per line."""
        text = _DESCRIPTIONS[self.method].format(cutoff=self.cutoff_hz)
        if self.resample_hz is not None:
            text += f", on a cubic spline through the values sampled at {self.resample_hz:g} Hz"
        fill = (
            f"gaps up to {self.fill_s:g} s filled by {_FILLED_BY[self.method]}"
            if self.fill_s
            else "gaps are not filled"
        )
        spans = boundaries_s if isinstance(boundaries_s, Mapping) else {"": boundaries_s}
        cuts = [f"{name} {', '.join(f'{t:.4f} s' for t in times)}".strip() for name, times in spans.items() if times]
        ends = f"segments end at {'; '.join(cuts)}" if cuts else "no take-off or landing splits the motion"
        return [f"smoothing: {text}", fill, ends]
