"""Lenses: how many numbers of them the evidence supports."""
