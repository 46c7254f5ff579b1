"""Scenes of a body in a gym: light, images, simulated measurements, and the trial that is written."""
