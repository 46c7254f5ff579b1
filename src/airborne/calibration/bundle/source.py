"""What is measured and what is free: the input of one bundle adjustment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.errors import CalibrationError
from airborne.types import Array, Ints

_TERMS = {
    0: (),
    1: (0,),
    2: (0, 1),
    3: (0, 1, 4),
    4: (0, 1, 2, 3),
    5: (0, 1, 2, 3, 4),
    8: tuple(range(8)),
}  # how many -> which


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeParameters:
    """Which parameters of a camera are estimated; the others keep their initial values."""

    extrinsics: bool = True  # position and orientation
    focal: bool = True
    shares_focal: str = ""  # cameras with the same word here share one focal length
    square_pixels: bool = True  # the ratio of both focal lengths is fixed
    principal_point: bool = False
    n_terms: int = (
        0  # k1 | k1 k2 | k1 k2 k3 | k1 k2 p1 p2 | all five | 8: the rational ones too; of a fisheye the first n
    )

    def parameters(self, lens: Literal["brown", "fisheye"] = "brown") -> tuple[int, ...]:
        """Return which of `lenses.CAMERA_PARAMETERS` are free, by index; of square pixels fx, without fy."""
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
    """Known distances between a source's points in the world, one a row."""

    first: Ints  # (k,) rows of the source's points
    second: Ints  # (k,)
    length_m: Array  # (k,) [m]
    sd_m: float | Array = 1e-4  # of all lengths or of each (k,) [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObservationLags:
    """Cameras that do not expose at the same instant: each group of observations of moving targets has its own lag.

    A target's velocity comes from its poses at the moments before and after.
    """

    group: Ints  # (n,) observations of one group, such as a camera's image, share a lag; -1: none
    time_s: Array  # (m,) of every moment [s]
    sd_s: float  # prior standard deviation of a lag about zero [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """Observations of one kind with the initial values of their unknowns; one row an observation.

    A point is fixed in the world (its moment is -1), known or free, or lies on a rigid target: then it is known in the
    target's axes, and the target's pose is free at every moment.
    """

    name: str
    camera: Ints  # (n,) rows of the rig
    point: Ints  # (n,) rows of points
    px: Array  # (n, 2) [px], pixel centres at whole numbers
    points: Array  # (p, 3) [m]: known, or initial values where free
    is_free: NDArray[np.bool_] | None = None  # (p,) or each coordinate (p, 3); None: all points are known
    moment: Ints | None = None  # (n,) rows of world_from_target, -1 for points in the world; None: all in the world
    world_from_target: RigidTransform | None = None  # (m,), the initial pose of every target
    is_fixed: NDArray[np.bool_] | None = None  # (m,) targets whose pose is fixed; None: none
    sd_px: float | Array = 1.0  # of a coordinate, of all or each (n,) [px]
    sd_is_known: bool = False  # False: sd_px is scaled to the residuals
    cluster: Ints | None = None  # (n,) observations of one cluster have correlated errors; None: independent
    lengths: Lengths | None = None
    lags: ObservationLags | None = None
    n_rejected: int = 0  # observations beside these, left out beforehand as they contradict one another
    is_surveyed: bool = False  # clicked points whose places in the world are known
    is_object: bool = False  # something moved about that is found in images, to a pixel or better
    is_of_lens: bool = False  # recorded by one camera alone, for its lens

    def __post_init__(self) -> None:
        n, p, m = len(self.px), len(self.points), self.n_moments
        columns = [self.camera, self.point] + [c for c in (self.moment, self.cluster) if c is not None]
        if any(len(column) != n for column in columns):
            raise CalibrationError(f"source '{self.name}': camera, point, moment and px have different lengths")
        if n and (self.point.max() >= p or self.moments.max() >= m or not np.isfinite(self.px).all()):
            raise CalibrationError(
                f"source '{self.name}': a point or moment does not exist, or a pixel is NaN or infinite"
            )

    def select(self, rows: NDArray[np.bool_]) -> Source:
        """Return the source with some of its observations (n,); points and targets keep their indices."""
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
        """Which coordinates of the points are estimated: (p, 3)."""
        if self.is_free is None:
            return np.zeros((len(self.points), 3), bool)
        free = np.asarray(self.is_free, bool)
        return np.repeat(free[:, None], 3, axis=1) if free.ndim == 1 else free

    @property
    def targets_of_fixed_points(self) -> NDArray[np.bool_]:
        """Which targets have a fixed pose: (m,)."""
        return np.zeros(self.n_moments, bool) if self.is_fixed is None else np.asarray(self.is_fixed, bool)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraPrior:
    """A normal prior of the cameras about their initial parameters."""

    sd: Array  # (cameras, 18), in the units of `lenses.CAMERA_PARAMETERS`; inf: no prior
