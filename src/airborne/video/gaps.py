"""Gaps of a video: times in which a camera has no image, said in one line for each camera."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

_FEW = 2  # chosen: so many gaps are each stated; more of them may come from a frame rate that varies


def describe_gaps(name: str, gaps: Mapping[Fraction, Fraction]) -> str:
    """Say where a camera has no image: gaps, from -> to [s], in order of time."""
    listed = [f"from {float(from_s):.3f} s to {float(to_s):.3f} s" for from_s, to_s in gaps.items()]
    where = " and ".join(listed)
    why = "missing, damaged or not filmed"
    if len(gaps) > _FEW:
        longest_s = max(to_s - from_s for from_s, to_s in gaps.items())
        where = f"at {len(gaps)} times, first {listed[0]}, for {float(longest_s):.3f} s at most"
        why += "; or the frame rate varies, as phones record: convert to a constant one, or record so"
    return f"{name}: no image {where} ({why}); after damage, images may carry it up to the next key frame"
