"""Initial values of the cameras, before the bundle adjustment."""
