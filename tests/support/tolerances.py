"""The tolerances of the tests, by name."""

EXACT = 1e-12  # the same formula twice
ROUNDTRIP = 1e-9  # there and back
SOLVED = 1e-4  # found by an iteration


def sampled(n: int) -> float:
    """Return the tolerance of a frequency over n draws: three standard errors."""
    return 3 / n**0.5
