"""The methods of smoothing, and one of them with its settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from airborne.errors import ResultError
from airborne.motion.smoothing.butterworth import butterworth_smoother
from airborne.motion.smoothing.kalman import kalman_smoother
from airborne.motion.smoothing.segments import SmoothedPaths, Smoother
from airborne.motion.smoothing.splines import spline_smoother

_LONGEST_FILL_S = 0.5  # of a gap that may be filled
SmoothingName = Literal["butterworth", "spline", "kalman"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SmoothingMethod:
    """A way to smooth, and what sets it apart from the others."""

    smoother: Callable[..., SmoothedPaths]  # a `Smoother` that takes `are_errors_slow` too, and what it has by settings
    description: str  # what was done, with the cut-off
    fills_by: str  # what a gap is filled by
    has_cutoff: bool = False  # takes `cutoff_hz`, and `resample_hz` for uneven times
    needs_covariances: bool = False
    conserves_momentum: bool = False  # the angular one of free flights


SMOOTHING_METHODS: dict[SmoothingName, SmoothingMethod] = {
    "butterworth": SmoothingMethod(
        smoother=butterworth_smoother,
        description="zero-lag Butterworth low-pass, second order forward and back, -3 dB of both at {cutoff:g} Hz",
        fills_by="a cubic spline through the known frames",
        has_cutoff=True,
    ),
    "spline": SmoothingMethod(
        smoother=spline_smoother,
        description="cubic smoothing spline by generalised cross-validation, weighted by 1 / variance",
        fills_by="the spline",
    ),
    "kalman": SmoothingMethod(
        smoother=kalman_smoother,
        description="Kalman smoother with white-noise jerk, its density by maximum likelihood, and the run's "
        "covariances",
        fills_by="the smoother's own model",
        needs_covariances=True,
        conserves_momentum=True,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Smoothing:
    """A smoothing method and its settings. Gaps up to `fill_s` [s] are filled; none by default.

    Raises ResultError for gaps too long to fill, and for a cut-off with another method.
    """

    method: SmoothingName
    cutoff_hz: float | None = None  # of the Butterworth filter; None if still to be chosen
    resample_hz: float | None = None  # of the Butterworth filter, for uneven times
    fill_s: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.fill_s <= _LONGEST_FILL_S:
            raise ResultError(
                f"gaps of {self.fill_s:g} s cannot be filled; give 0 to {_LONGEST_FILL_S:g} s: "
                "the motion in between is unknown"
            )
        if not self.way.has_cutoff and not (self.cutoff_hz is self.resample_hz is None):
            raise ResultError(
                f"cut-off and resampling are a Butterworth filter's (--butterworth); leave them out of {self.method}"
            )

    @property
    def way(self) -> SmoothingMethod:
        """What its method does."""
        return SMOOTHING_METHODS[self.method]

    @property
    def lacks_cutoff(self) -> bool:
        """Whether a cut-off is still to be chosen."""
        return self.way.has_cutoff and self.cutoff_hz is None

    def smoother(self, *, has_joints: bool) -> Smoother:
        """Return the smoother of one stretch, of a body with joints or without: errors of one with joints are slow.

        Raises ResultError for a Butterworth filter without a cut-off.
        """
        if self.lacks_cutoff:
            raise ResultError("a Butterworth filter needs a cut-off in Hz; give one, such as 6")
        settings = {"cutoff_hz": self.cutoff_hz, "resample_hz": self.resample_hz} if self.way.has_cutoff else {}
        return partial(self.way.smoother, are_errors_slow=has_joints, **settings)

    def history(self, boundaries_s: Sequence[float] | Mapping[str, Sequence[float]]) -> list[str]:
        """Describe what was done, one operation per line."""
        text = self.way.description.format(cutoff=self.cutoff_hz)
        if self.resample_hz is not None:
            text += f", on a cubic spline through the values sampled at {self.resample_hz:g} Hz"
        fill = f"gaps up to {self.fill_s:g} s filled by {self.way.fills_by}" if self.fill_s else "gaps are not filled"
        spans = boundaries_s if isinstance(boundaries_s, Mapping) else {"": boundaries_s}
        cuts = [f"{name} {', '.join(f'{t:.4f} s' for t in times)}".strip() for name, times in spans.items() if times]
        ends = f"segments end at {'; '.join(cuts)}" if cuts else "no take-off or landing splits the motion"
        return [f"smoothing: {text}", fill, ends]
