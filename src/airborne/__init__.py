"""Airborne measures bodies in flight from ordinary multi-camera colour video."""

__version__ = "0.1.0"
