"""What is measured and what is free: values that say one bundle adjustment's whole task."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.errors import CalibrationError
from airborne.types import Array, Ints

_TERMS = {0: (), 1: (0,), 2: (0, 1), 3: (0, 1, 4), 4: (0, 1, 2, 3), 5: (0, 1, 2, 3, 4)}  # how many -> which


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeParameters:
    """Which numbers of a camera are found; the others keep the values of the start."""

    extrinsics: bool = True  # position and orientation
    focal: bool = True
    shares_focal: str = ""  # cameras with the same word here have one focal length in common
    square_pixels: bool = True  # both focal lengths change alike
    principal_point: bool = False
    n_terms: int = 0  # lens terms: k1 | k1 k2 | k1 k2 k3 | k1 k2 p1 p2 | all five; of a fisheye the first n of four

    def parameters(self, lens: Literal["brown", "fisheye"] = "brown") -> tuple[int, ...]:
        """Return which of a camera's 15 numbers (see `lenses.NUMBERS`) are free, fy not beside a square fx."""
        terms = _TERMS[self.n_terms] if lens == "brown" else tuple(range(min(self.n_terms, 4)))
        return (
            *(range(6) if self.extrinsics else ()),
            *((6,) if self.focal else ()),
            *((7,) if self.focal and not self.square_pixels else ()),
            *((8, 9) if self.principal_point else ()),
            *(10 + term for term in terms),
        )


ALL_FIXED = FreeParameters(extrinsics=False, focal=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lengths:
    """Known distances between a source's points that stand in the world, one a row."""

    first: Ints  # (k,) rows of the source's points
    second: Ints  # (k,)
    length_m: Array  # (k,) [m]
    sd_m: float | Array = 1e-4  # of all lengths or of each (k,) [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObservationLags:
    """Cameras that do not look at the same instant: each group of observations of moving targets has its own lag.

    A target's velocity comes from its places at the moments before and after.
    """

    group: Ints  # (n,) observations of one group, such as a camera's picture, share a lag; -1: none
    time_s: Array  # (m,) of every moment [s]
    sd_s: float  # of a lag, thought to be about zero [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """What one kind of evidence says, and where its unknowns start; one row an observation.

    A point stands in the world (its moment is -1), known or free, or on a rigid target: then it is known in the
    target's axes, and the target's place is free at every moment.
    """

    name: str
    camera: Ints  # (n,) rows of the rig
    point: Ints  # (n,) rows of points
    px: Array  # (n, 2) [px], pixel centres at whole numbers
    points: Array  # (p, 3) [m]: known, or the start where free
    is_free: NDArray[np.bool_] | None = None  # (p,) or each coordinate (p, 3); None: all points are known
    moment: Ints | None = None  # (n,) rows of world_from_target, -1 for points in the world; None: all in the world
    world_from_target: RigidTransform | None = None  # (m,), the start of every target
    is_fixed: NDArray[np.bool_] | None = None  # (m,) targets that stay as they start; None: none
    sd_px: float | Array = 1.0  # of a coordinate, of all or each (n,) [px]
    sd_is_known: bool = False  # False: sd_px is scaled to the residuals
    cluster: Ints | None = None  # (n,) observations of one cluster share errors; None: every error is its own
    lengths: Lengths | None = None
    lags: ObservationLags | None = None

    def __post_init__(self) -> None:
        n, p, m = len(self.px), len(self.points), self.n_moments
        columns = [self.camera, self.point] + [c for c in (self.moment, self.cluster) if c is not None]
        if any(len(column) != n for column in columns):
            raise CalibrationError(f"source '{self.name}': camera, point, moment and px have different lengths")
        if n and (self.point.max() >= p or self.moments.max() >= m or not np.isfinite(self.px).all()):
            raise CalibrationError(f"source '{self.name}': a point or moment is not there, or a pixel is no number")

    def select(self, rows: NDArray[np.bool_]) -> Source:
        """Return the source with some of its observations (n,); points and targets keep their numbers."""
        lags, sd_px = self.lags, np.asarray(self.sd_px)
        return replace(
            self,
            camera=self.camera[rows],
            point=self.point[rows],
            px=self.px[rows],
            moment=None if self.moment is None else self.moment[rows],
            cluster=None if self.cluster is None else self.cluster[rows],
            sd_px=self.sd_px if sd_px.ndim == 0 else sd_px[rows],
            lags=None if lags is None else replace(lags, group=lags.group[rows]),
        )

    @property
    def n_moments(self) -> int:
        """How many targets there are."""
        return 0 if self.world_from_target is None else len(self.world_from_target)

    @property
    def moments(self) -> Ints:
        """Every observation's moment (n,), -1 in the world."""
        return np.full(len(self.px), -1) if self.moment is None else self.moment

    @property
    def free_coordinates(self) -> NDArray[np.bool_]:
        """Which coordinates of the points are found: (p, 3)."""
        if self.is_free is None:
            return np.zeros((len(self.points), 3), bool)
        free = np.asarray(self.is_free, bool)
        return np.repeat(free[:, None], 3, axis=1) if free.ndim == 1 else free

    @property
    def fixed_targets(self) -> NDArray[np.bool_]:
        """Which targets stay as they start: (m,)."""
        return np.zeros(self.n_moments, bool) if self.is_fixed is None else np.asarray(self.is_fixed, bool)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraPrior:
    """What is known of the cameras beforehand: their numbers at the start, each with a standard deviation."""

    sd: Array  # (cameras, 15), in the units of `lenses.NUMBERS`; inf: nothing is known
