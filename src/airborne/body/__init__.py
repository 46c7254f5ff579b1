"""Body models: body files in, `BodyModel`, `Pose` and `PosedBody` out; independent of cameras and images."""

from airborne.body.human import human18, human18_from_measurements
from airborne.body.inverse_kinematics import PoseFit, fit_lengths, fit_pose
from airborne.body.measurements import Measurements, read_measurements
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
from airborne.body.outfits import ATHLETE, SAMPLED, Outfit
from airborne.body.shaping import with_girths, with_segment_lengths
from airborne.body.surface import SurfaceArrays, has_flat_sides, surface_arrays, surface_of_segments

__all__ = [
    "ATHLETE",
    "SAMPLED",
    "BodyModel",
    "Box",
    "Ellipsoid",
    "Inertia",
    "Landmark",
    "Measurements",
    "Mesh",
    "Outfit",
    "Part",
    "Pose",
    "PoseFit",
    "PosedBody",
    "Segment",
    "Shape",
    "SurfaceArrays",
    "fit_lengths",
    "fit_pose",
    "has_flat_sides",
    "human18",
    "human18_from_measurements",
    "read_measurements",
    "surface_arrays",
    "surface_of_segments",
    "with_girths",
    "with_segment_lengths",
]
