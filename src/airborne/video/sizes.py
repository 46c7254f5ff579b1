"""Whether videos have the size that their cameras were calibrated at, and what to write where they have not."""

from __future__ import annotations

import math
from collections.abc import Sequence

from airborne.cameras import Rig
from airborne.cameras.finding import join_names
from airborne.errors import VideoError
from airborne.types import Size
from airborne.video.decoding import VideoSource

_SAME_SHAPE = 0.005  # of the ratio of two sizes: a resized picture is rounded to whole pixels, often to even ones


def check_sizes(sources: Sequence[VideoSource], rig: Rig, sizes: Sequence[Size]) -> None:
    """Raise VideoError where the size (width, height) [px] of a video's images is not its camera's."""
    given = list(zip(sources, rig, sizes, strict=True))
    wrong = [(source, size, camera.size) for source, camera, size in given if tuple(size) != tuple(camera.size)]
    if not wrong:
        return
    (source, size, calibrated), *others = wrong
    actual, expected = ("×".join(map(str, each)) for each in (size, calibrated))
    verb = "differs" if len(others) == 1 else "differ"
    also = f" ({join_names([each.name for each, *_ in others])} {verb} too)" if others else ""
    raise VideoError(
        f"{source.name}: {source.path} is {actual} px, but the calibration's camera is {expected} px{also}; give the "
        f"video that was calibrated, or the calibration of this size{_advise_on_size(size, calibrated)}"
    )


def _advise_on_size(size: Size, calibrated: Size) -> str:
    """Say what to write for a video that shows what was calibrated, saved at another size or cut out of it."""
    if tuple(size) == tuple(calibrated)[::-1]:
        return (
            "; it is turned by 90 degrees, by itself or by a flag in its file: write it anew as it was calibrated, or "
            "take the flag out"
        )
    across, down = (b / a for a, b in zip(size, calibrated, strict=True))
    if math.isclose(across, down, rel_tol=_SAME_SHAPE):
        return f"; if the picture was only resized, write under [[camera]] {lines_of_scale(across)}"
    if across < 1 or down < 1:
        return ""
    return (
        "; if the picture was only cut out of the calibrated one, write under [[camera]] saved_offset_px, where its "
        "first pixel lies in that; if it was resized too, saved_scale as well: calibration px = saved_scale × video px "
        "+ saved_offset_px"
    )


def lines_of_scale(scale: float) -> str:
    """Return what a trial says of a video whose pixels are each `scale` of the calibration's wide."""
    offset_px = f"{(scale - 1) / 2:.6g}"
    return f"saved_scale = {scale:.6g} and saved_offset_px = [{offset_px}, {offset_px}]"
