"""Cameras: in come control points or calibration files, out come `Camera` and `Rig`; knows no video and no body."""

from airborne.cameras.camera import Camera, Rig

__all__ = ["Camera", "Rig"]
