"""Tracking: in come `Frames`, a body and a first pose, out come `Estimate`s; knows no files and no reports."""

from airborne.tracking.estimate import Estimate, Status

__all__ = ["Estimate", "Status"]
