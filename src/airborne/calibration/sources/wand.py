"""A waved wand: two or more markers at known distances, seen by several cameras frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.bundle.source import Lengths, Source
from airborne.cameras.camera import Rig
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.formats.dltdv import is_xypts, read_xypts
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError
from airborne.io.text import read_csv
from airborne.types import Array

_LENGTH_SD_M = 5e-4  # of a wand's measured length
LENGTH_RANGE_M = (0.02, 20.0)  # of plausible wands
_LENGTH_SHARE = 0.15  # relative error of length from which on markers are outliers
_MOST_MARKERS = 20  # of a wand: a larger number is a frame or a coordinate
_COLUMNS = {"frame", "marker", "camera", "u_px", "v_px"}
_EXPECTED = "expected frame,marker,camera,u_px,v_px or DLTdv's pt1_cam1_U,pt1_cam1_V,pt1_cam2_U,..."


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WandTracks:
    """The markers of a wand in the images of several cameras; NaN where not seen."""

    cameras: tuple[str, ...]
    px: Array  # (frames, markers, cameras, 2) [px]
    lengths_m: Mapping[tuple[int, int], float]  # between two markers, counted from 0 [m]
    sd_m: float = _LENGTH_SD_M  # of each length [m]

    def __post_init__(self) -> None:
        n = self.px.shape[1]
        if not self.lengths_m:
            raise CalibrationError("the wand has no length; give length_m = the distance between its markers in metres")
        for pair, length in self.lengths_m.items():
            if not (0 <= min(pair) < max(pair) < n):
                raise CalibrationError(
                    f"a length of the wand is between markers {pair[0] + 1} and {pair[1] + 1}; the tracks have {n}"
                )
            if not LENGTH_RANGE_M[0] <= length <= LENGTH_RANGE_M[1]:
                raise CalibrationError(
                    f"the wand is {length:g} m long; expected {LENGTH_RANGE_M[0]:g} to {LENGTH_RANGE_M[1]:g} m: "
                    "give metres, not millimetres"
                )

    def select(self, cameras: Sequence[str]) -> WandTracks:
        """Return the tracks of the named cameras, in that order."""
        columns = [self.cameras.index(name) for name in cameras]
        return replace(self, cameras=tuple(cameras), px=self.px[:, :, columns])


def read_wand(path: Path, cameras: Sequence[str], options: FileOptions, lengths_m: Sequence[float]) -> WandTracks:
    """Read a wand's tracks: DLTdv's or easyWand's `xypts.csv`, or a table `frame,marker,camera,u_px,v_px`.

    cameras name the columns of xypts, in their order; the options give its pixel convention. The table counts markers
    from 1 and has our own pixels. lengths_m [m] are those between markers 1 and 2, 2 and 3, and so on. Raises
    CalibrationError.
    """
    rows = read_csv(path, _EXPECTED, CalibrationError)
    header = ",".join(rows[0][1]) if rows else ""
    px = read_xypts(path, options, cameras).px if is_xypts(header) else _tracks(path, rows, cameras)
    if px.shape[1] != len(lengths_m) + 1:
        raise CalibrationError(
            f"{path} holds {px.shape[1]} markers; expected {len(lengths_m) + 1}, one more than lengths are given: keep "
            "the wand's own markers, and give a length from each to the next"
        )
    lengths = {(i, i + 1): float(length) for i, length in enumerate(lengths_m)}
    return WandTracks(cameras=tuple(cameras), px=px, lengths_m=lengths)


def _tracks(path: Path, rows: Sequence[tuple[int, list[str]]], cameras: Sequence[str]) -> Array:
    """Sort rows of one frame, marker and camera, in any order: (frames, markers, cameras, 2) [px], NaN elsewhere."""
    (_, header), *rows = rows or [(1, [])]
    if not rows or not set(header) >= _COLUMNS:
        raise CalibrationError(f"{path}: found {','.join(header)[:80] or 'nothing'}; {_EXPECTED}")
    pixels: dict[tuple[int, int, int], tuple[float, float]] = {}
    for line, cells in rows:
        if len(cells) != len(header):
            raise CalibrationError(f"{path}, row {line}: {len(cells)} values, expected {len(header)} as in the header")
        key, px = _row(f"{path}, row {line}", dict(zip(header, cells, strict=True)), cameras)
        if key in pixels:
            raise CalibrationError(f"{path}, row {line}: this frame, marker and camera stand twice; remove one")
        pixels[key] = px
    frames = {frame: i for i, frame in enumerate(sorted({frame for frame, _, _ in pixels}))}
    px = np.full((len(frames), 1 + max(marker for _, marker, _ in pixels), len(cameras), 2), np.nan)
    for (frame, marker, camera), uv in pixels.items():
        px[frames[frame], marker, camera] = uv
    return px


def _row(
    where: str, row: Mapping[str, str], cameras: Sequence[str]
) -> tuple[tuple[int, int, int], tuple[float, float]]:
    try:
        frame, marker = int(row["frame"]), int(row["marker"])
        u, v = (float(row[key] or "nan") for key in ("u_px", "v_px"))
    except ValueError:
        raise CalibrationError(f"{where}: expected whole numbers for frame and marker, pixels or blanks else") from None
    if not 1 <= marker <= _MOST_MARKERS:
        raise CalibrationError(f"{where}: marker {marker}; count the wand's markers from 1 to {_MOST_MARKERS} at most")
    camera = row["camera"]
    if camera not in cameras:
        raise CalibrationError(f"{where}: camera '{camera}' is not one of {', '.join(cameras)}")
    if np.isinf([u, v]).any() or np.isnan(u) != np.isnan(v):
        raise CalibrationError(f"{where}: u_px and v_px must both be pixels, or both blank")
    return (frame, marker - 1, cameras.index(camera)), (u, v)


def wand_source(rig: Rig, tracks: WandTracks) -> Source:
    """Return the wand as a source: its markers as free points, triangulated with the rig, with their known lengths.

    Outlier views are left out (see `triangulate_consensus`), and so are two markers whose distance is far from the
    known length.
    """
    tracks = tracks.select([name for name in rig.names if name in tracks.cameras])
    rows = np.array([rig.names.index(name) for name in tracks.cameras])
    consensus = triangulate_consensus(rig.select(tracks.cameras), tracks.px, np.ones(tracks.px.shape[:-1]))
    is_known = np.isfinite(consensus.points[..., 0]) & ~_has_wrong_length(tracks, consensus.points)
    index_of_point = np.full(is_known.shape, -1)
    index_of_point[is_known] = np.arange(is_known.sum())
    is_used = consensus.is_used & is_known[..., None]
    frame, marker, column = np.nonzero(is_used)
    is_seen = np.isfinite(tracks.px).all(axis=-1)
    is_seen &= is_seen.sum(axis=-1, keepdims=True) > 1  # by one camera alone it says nothing
    return Source(
        name="wand",
        camera=rows[column],
        point=index_of_point[frame, marker],
        px=tracks.px[frame, marker, column],
        points=consensus.points[is_known],
        is_free=np.ones(is_known.sum(), bool),
        sd_px=0.5,
        lengths=_lengths(tracks, index_of_point),
        n_rejected=int((is_seen & ~is_used).sum()),
        is_object=True,
    )


def _has_wrong_length(tracks: WandTracks, points: Array) -> NDArray[np.bool_]:
    """Say which markers (frames, markers) have a wrong distance to another; points (frames, markers, 3) [m]."""
    is_wrong = np.zeros(points.shape[:2], bool)
    for (a, b), length_m in tracks.lengths_m.items():
        distance = np.linalg.norm(points[:, a] - points[:, b], axis=-1)
        is_off = np.abs(distance / length_m - 1) > _LENGTH_SHARE  # NaN compares as right
        is_wrong[:, a] |= is_off
        is_wrong[:, b] |= is_off
    return is_wrong


def _lengths(tracks: WandTracks, index_of_point: NDArray[np.integer]) -> Lengths:
    first, second, length = [], [], []
    for (a, b), length_m in tracks.lengths_m.items():
        both = (index_of_point[:, a] >= 0) & (index_of_point[:, b] >= 0)
        first.append(index_of_point[both, a])
        second.append(index_of_point[both, b])
        length.append(np.full(both.sum(), length_m))
    return Lengths(
        first=np.concatenate(first), second=np.concatenate(second), length_m=np.concatenate(length), sd_m=tracks.sd_m
    )
