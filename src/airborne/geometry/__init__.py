"""Geometry: rotations and triangulation, arrays in and arrays out; knows no camera, no body and no file."""

from airborne.geometry.rotations import angles_from_matrix, geodesic, matrix_from_angles, unwrap
from airborne.geometry.triangulation import triangulate

__all__ = ["angles_from_matrix", "geodesic", "matrix_from_angles", "triangulate", "unwrap"]
