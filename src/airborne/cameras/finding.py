"""What is wrong with a calibration, in one plain sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One diagnosis: what is wrong, with the number that shows it, and what to do."""

    kind: str  # one word for programs: "board", "coverage", "bridge", "mirrored", "turned", "moved", "swapped", ...
    what: str
    advice: str
    cameras: tuple[str, ...] = ()  # which it concerns; empty: all
    points: tuple[str, ...] = ()  # of control points, which it concerns; empty: all

    @property
    def sentence(self) -> str:
        """The whole, in one line."""
        return f"{self.what}: {self.advice}"


def join_names(names: Sequence[str]) -> str:
    """Join names as people write them: a, b and c."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]])) if names else "none"
