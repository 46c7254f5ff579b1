"""Tracking: in come `Frames`, a body and a first pose, out come `Estimate`s; knows no files and no reports."""

from airborne.tracking.estimate import Doubt, Estimate, Status

__all__ = ["Doubt", "Estimate", "Status"]
