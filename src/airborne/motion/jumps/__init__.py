"""Jumps of players: legs over time in, heights in four definitions and their events out."""
