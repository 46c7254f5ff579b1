"""A wand's markers found in the cameras' videos: two round blobs, bright or coloured, a known length apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from airborne.calibration.initial.wand import initial_rig_from_wand
from airborne.calibration.sources.board_detection import match_moments, read_video_images
from airborne.calibration.sources.files import Sources, pixel_convention
from airborne.calibration.sources.wand import WandTracks, read_wand, wand_source
from airborne.calibration.sources.wand_blobs import NO_BLOBS, Blobs, background_of, find_blobs
from airborne.calibration.sources.wand_matching import match_markers
from airborne.cameras.finding import Finding
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError
from airborne.types import Progress

_N_BACKGROUND = 15  # images whose median is the background
_LEAST_RIGHT = 0.5  # share of the frames with two markers in which they are as far apart as they should


@dataclass(frozen=True, slots=True, eq=False)
class WandDetections:
    """A wand's tracks, and what is to be said about them where they were found in videos."""

    tracks: WandTracks
    notes: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()  # about the videos


def find_wand(sources: Sources, sizes: Mapping[str, tuple[int, int]], progress: Progress) -> WandDetections | None:
    """Read the wand's table, or find it in the videos; None without a wand. Raises VideoError or CalibrationError."""
    table = sources.wand
    if table is None:
        return None
    if table.file is None:
        return detect_wand(sources, table.length_m or 0.0, sizes, progress)
    options = FileOptions(size=dict(sizes), pixels=pixel_convention(table.pixels))
    lengths = table.lengths_m or [table.length_m or 0.0]
    return WandDetections(read_wand(sources.path(table.file), table.cameras or sources.names, options, lengths))


def detect_wand(
    sources: Sources, length_m: float, sizes: Mapping[str, tuple[int, int]], progress: Progress
) -> WandDetections:
    """Find a wand of two markers in the videos of all cameras. Raises VideoError, and CalibrationError without one."""
    cameras = [camera for camera in sources.camera if camera.video]
    if len(cameras) < 2:
        raise CalibrationError(
            "[wand] is looked for in videos: add video = ... to two cameras at least, or give file = its markers' table"
        )
    moments, _, findings = match_moments(sources, cameras)
    total, done, blobs = sum(len(own) for own in moments), 0, []
    n = max(max(own.values(), default=-1) for own in moments) + 1
    for camera, own in zip(cameras, moments, strict=True):
        background = background_of([rgb for _, rgb in read_video_images(sources, camera, _spread(own))])
        row = [NO_BLOBS] * n
        for index, rgb in read_video_images(sources, camera, own):
            row[own[index]] = find_blobs(rgb, background)
            done += 1
            progress(done, total)
        blobs.append(row)
    names = tuple(camera.name for camera in cameras)
    guesses = [
        WandTracks(cameras=names, px=px, lengths_m={(0, 1): length_m})
        for px in match_markers(blobs, [sizes[name] for name in names])
    ]
    best, n_right = _choose(guesses, sizes)
    if best is None:
        raise CalibrationError(_say_nothing_found(names, blobs, guesses))
    seen = np.isfinite(best.px[:, 0, :, 0])
    counts = ", ".join(f"{name} {k}" for name, k in zip(names, seen.sum(axis=0).tolist(), strict=True))
    n_shared = int((seen.sum(axis=1) > 1).sum())
    note = (
        f"the wand is seen by two cameras or more in {n_shared} of {n} frames ({counts}), {n_right} times at its length"
    )
    return WandDetections(best, (note,), findings)


def _spread(own: Mapping[int, int]) -> set[int]:
    frames = np.array(sorted(own))
    return set(frames[np.linspace(0, len(frames) - 1, _N_BACKGROUND).astype(int)].tolist())


def _choose(guesses: Sequence[WandTracks], sizes: Mapping[str, tuple[int, int]]) -> tuple[WandTracks | None, int]:
    """Return the guess that is as long as it should be in most frames, and in how many."""
    best, most = None, 0
    for tracks in guesses:
        n_shared = int((np.isfinite(tracks.px[:, 0, :, 0]).sum(axis=1) > 1).sum())
        try:
            rig = initial_rig_from_wand(tracks, {name: sizes[name] for name in tracks.cameras})
        except CalibrationError:
            continue
        lengths = wand_source(rig, tracks).lengths
        n_right = 0 if lengths is None else len(lengths.first)
        if n_right > max(most, _LEAST_RIGHT * n_shared):
            best, most = tracks, n_right
    return best, most


def _say_nothing_found(names: Sequence[str], blobs: Sequence[Sequence[Blobs]], guesses: Sequence[WandTracks]) -> str:
    counts = ", ".join(
        f"{name} {sum(len(each.px) > 1 for each in row)} of {len(row)}" for name, row in zip(names, blobs, strict=True)
    )
    why = (
        "what was matched between them is too little, or not of one length: are they in step?"
        if guesses
        else "two cameras must show the same two blobs, and no third of their colours, in ten frames at least."
    )
    return (
        f"no wand is found; frames with two round, moving, bright or coloured blobs: {counts}; {why} "
        "Film two balls unlike all else on a dark stick, or digitise them and give their table"
    )
