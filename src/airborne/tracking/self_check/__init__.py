"""Self-check: what a finished run's own pictures say against the body's size, the cameras and their times."""
