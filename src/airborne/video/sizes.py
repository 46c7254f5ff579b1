"""Whether videos have the size that their cameras were calibrated at, and what to write where they have not."""

from __future__ import annotations

import math
from collections.abc import Sequence

from airborne.cameras import Rig
from airborne.errors import VideoError
from airborne.video.decoding import VideoFacts, VideoSource

_SAME_SHAPE = 0.005  # of the ratio of two sizes: a resized picture is rounded to whole pixels, often to even ones


def check_sizes(sources: Sequence[VideoSource], rig: Rig, facts: Sequence[VideoFacts]) -> None:
    """Raise VideoError where the size of a video's images differs from its camera's in the calibration."""
    for source, camera, fact in zip(sources, rig, facts, strict=True):
        if fact.size != tuple(camera.size):
            actual, expected = ("×".join(map(str, size)) for size in (fact.size, camera.size))
            raise VideoError(
                f"{source.name}: {source.path} is {actual} px, but the calibration's camera is {expected} px; give the "
                f"video that was calibrated, or the calibration of this size{_saved_otherwise(fact.size, camera.size)}"
            )


def _saved_otherwise(size: tuple[int, int], calibrated: tuple[int, int]) -> str:
    """Say what to write for a video that shows what was calibrated, saved at another size or cut out of it."""
    across, down = (b / a for a, b in zip(size, calibrated, strict=True))
    if math.isclose(across, down, rel_tol=_SAME_SHAPE):
        offset_px = f"{(across - 1) / 2:.6g}"
        how, lines = "resized", f"saved_scale = {across:.6g} and saved_offset_px = [{offset_px}, {offset_px}]"
    elif across >= 1 and down >= 1:
        how, lines = "cut out of the calibrated one", "saved_offset_px, where its first pixel lies in that"
    else:
        return ""
    return f"; if the picture was only {how}, write under [[camera]] {lines}"
