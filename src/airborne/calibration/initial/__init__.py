"""Initial values: where each camera begins, before anything is adjusted."""
