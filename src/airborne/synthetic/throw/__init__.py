"""Scenes of a body in a gym: light, pictures, what a person would measure there, and the trial that is written."""
