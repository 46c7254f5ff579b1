"""Trackers that only evaluate a score: paper B's stepping, and the simplex."""
