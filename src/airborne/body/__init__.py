"""Bodies: in come body files, out come `BodyModel`, `Pose` and `PosedBody`; knows no camera and no image."""

from airborne.body.geometry import Geometry, geometry, has_flat_sides
from airborne.body.model import (
    BodyModel,
    Box,
    Ellipsoid,
    Inertia,
    Landmark,
    Mesh,
    Part,
    Pose,
    PosedBody,
    Segment,
    Shape,
)

__all__ = [
    "BodyModel",
    "Box",
    "Ellipsoid",
    "Geometry",
    "Inertia",
    "Landmark",
    "Mesh",
    "Part",
    "Pose",
    "PosedBody",
    "Segment",
    "Shape",
    "geometry",
    "has_flat_sides",
]
