"""What the Gauss-Newton kernels take: arrays with names."""

from __future__ import annotations

from typing import Any, NamedTuple


class Window(NamedTuple):
    """A part of an image: x0 <= x < x1, y0 <= y < y1 [px]."""

    x0: int
    y0: int
    x1: int
    y1: int


class PackedBody(NamedTuple):
    """A body without a pose."""

    shapes: Any  # the workspace of `new_shapes`
    geometry: Any  # its SurfaceArrays
    segment_of_part: Any  # (parts,)


class Paint(NamedTuple):
    """How the parts reflect."""

    albedo: Any  # (parts, 3) linear light
    is_faceted: Any  # (parts,), see `flatten_shading`
    cloth: Any  # (parts,) which parts are of one cloth: they are shaded alike


class Projection(NamedTuple):
    """A posed body (s segments) in a view."""

    R: Any  # (s, 3, 3) world from segment
    t: Any  # (s, 3) [m]
    packed_view: Any  # (18,)
    K: Any  # (3, 3) [px]
    origin: Any  # (3,) [m] of all twists


class Comparison(NamedTuple):
    """How an image is compared."""

    taps_u: Any  # (5,) of the blur along rows
    taps_v: Any  # (5,) along columns
    clip: float  # the residual at which a pixel's weight has fallen to a quarter


class Observation(NamedTuple):
    """A view's image, of c channels."""

    observed: Any  # (c, H, W)
    background: Any  # (c, H, W)
    certainty: Any  # (H, W) factor 0..1 of each pixel's weight
    rows: Any = None  # (H, 2 c + 2, W + LANES) of `prepare_rows`
