"""Trackers that only ask for a score: paper B's stepping, and the simplex."""
