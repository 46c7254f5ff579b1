"""Scenes of a volleyball block: players, footwork, jumps, the hall, its cameras and pictures."""
