"""What can be wrong with several cameras' videos before any image of them is read: exposures, overlap, fields."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from airborne.errors import VideoError
from airborne.video.decoding import VideoFacts, VideoSource


def check_exposures(sources: Sequence[VideoSource], facts: Sequence[VideoFacts]) -> None:
    """Raise VideoError where an image would be exposed for longer than the time to the next."""
    for source, fact in zip(sources, facts, strict=True):
        if source.exposure_s * fact.image_rate > 1:
            raise VideoError(
                f"{source.name}: exposure_s is {source.exposure_s:g}, but the next image follows after "
                f"{float(1 / fact.image_rate):.4g} s; give the shutter's time in seconds (1/500 s is 0.002)"
            )


def check_overlap(sources: Sequence[VideoSource], facts: Sequence[VideoFacts]) -> None:
    """Raise VideoError where a camera has ended, by the files' durations, before all that follow begin."""
    if any(fact.duration_s is None for fact in facts):
        return
    spans = [
        (source.trial_time(Fraction(0)), source.trial_time(fact.duration_s or Fraction(0)), source.name)
        for source, fact in zip(sources, facts, strict=True)
    ]
    spans.sort()
    end_s = spans[0][1]
    for begin_s, own_end_s, name in spans[1:]:
        if begin_s >= end_s:
            raise VideoError(
                f"{name} begins at {float(begin_s):.3f} s, when the cameras before it ({spans[0][2]}, ...) ended at "
                f"{float(end_s):.3f} s: no two overlap; correct offset_s"
            )
        end_s = max(end_s, own_end_s)


def describe_fields(sources: Sequence[VideoSource], facts: Sequence[VideoFacts]) -> Iterator[str]:
    """Say of each video how its images are read, where its flags alone say so or say otherwise."""
    for source, fact in zip(sources, facts, strict=True):
        if source.fields == "auto":
            yield f"{source.name}: the file's flags say {fact.flagged_order}"
        elif fact.flagged_order != fact.fields:
            advice = f'; if moving edges look like combs, write fields = "{fact.flagged_order}"'
            is_whole = fact.fields == "progressive"
            yield (
                f"{source.name}: read as {fact.fields}, though the file's flags say {fact.flagged_order}"
                f"{advice if is_whole else ''}"
            )
