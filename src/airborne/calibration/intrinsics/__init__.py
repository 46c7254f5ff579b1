"""Intrinsics: how many lens parameters the observations support."""
