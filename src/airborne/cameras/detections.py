"""2D detections: a person's keypoints in every camera's images, found by a pose network or clicked.

Keypoints have our own names (`hip_left`, `toe_right`, ...), whichever skeleton the network uses: see `skeletons`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.formats.openpose import camera_folders, number_at_end, read_folder, write_folders
from airborne.cameras.skeletons import LANDMARK_RECIPES, SKELETONS, choose_skeleton
from airborne.errors import CalibrationError
from airborne.io.names import check_name
from airborne.io.npz import read_arrays, write_arrays
from airborne.types import Array

_SKELETON = "skeleton"  # the array of a .npz that names its skeleton
_OF_SHARES = (-0.5, 1.5)  # chosen: where shares of an image lie, of points a little outside of it too


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections:
    """Keypoints of one person in the images of several cameras, frame by frame."""

    cameras: tuple[str, ...]
    points: tuple[str, ...]
    px: Array  # (frames, points, cameras, 2) [px] of the videos themselves; NaN where not seen
    visibility: Array  # (frames, points, cameras) 0..1: the network's confidence; 0 where not seen
    notes: tuple[str, ...] = ()  # what the reader should know, one line each

    def __post_init__(self) -> None:
        try:
            list(map(check_name, self.cameras))
        except ValueError as error:
            raise CalibrationError(f"detections: {error}") from None

    @classmethod
    def from_clicks(cls, cameras: Sequence[str], points: Sequence[str], px: Array) -> Detections:
        """Return points clicked by hand, px (frames, points, cameras, 2) [px]; seen where both numbers are known."""
        is_seen = np.asarray(np.isfinite(px).all(axis=-1))
        px = np.where(is_seen[..., None], px, np.nan)
        return cls(cameras=tuple(cameras), points=tuple(points), px=px, visibility=is_seen.astype(float))

    def select(self, cameras: Sequence[str]) -> Detections:
        """Return the detections of the named cameras, in that order."""
        columns = [self.cameras.index(name) for name in cameras]
        px, visibility = self.px[:, :, columns], self.visibility[:, :, columns]
        return replace(self, cameras=tuple(cameras), px=px, visibility=visibility)

    def at(self, frames: NDArray[np.integer]) -> Detections:
        """Return the detections at each camera's own frames (n, cameras); not seen where a frame is not there."""
        is_there = (frames >= 0) & (frames < len(self.px))
        row, column = np.where(is_there, frames, 0), np.arange(len(self.cameras))
        px = np.moveaxis(self.px[row, :, column], 1, 2)  # from (n, cameras, points, 2)
        visibility = np.moveaxis(self.visibility[row, :, column], 1, 2)
        px = np.where(is_there[:, None, :, None], px, np.nan)
        return replace(self, px=px, visibility=np.where(is_there[:, None], visibility, 0.0))

    def above_visibility(self, least: float) -> Detections:
        """Return the detections with a visibility of `least` or more; the others count as not seen."""
        is_sure = self.visibility >= least
        return replace(
            self, px=np.where(is_sure[..., None], self.px, np.nan), visibility=np.where(is_sure, self.visibility, 0.0)
        )


def read_detections(
    path: Path,
    cameras: Sequence[str],
    named: Mapping[str, str] | None = None,
    *,
    person: int | None = None,
    skeleton: str | None = None,
) -> Detections:
    """Read the detections of the cameras from a `.npz` file or a folder of OpenPose JSON.

    `.npz`: one array (frames, points, 3) a camera, x, y [px] and visibility. Folder: `<camera>_json` or `<camera>`
    below it, one file a frame, the frame being the last number of the file's name. An array or folder belongs to a
    camera by `named`, by its name, or by the number that it ends in. Of several people in an image the one with the
    highest confidence is taken, or the one with the index `person` in each file. Which points they are say a string
    `skeleton` in the `.npz` or in the JSON files, or the argument. Raises CalibrationError where a camera is missing,
    where two people have about the same confidence and `person` does not say which, and for an unknown skeleton.
    """
    if path.is_dir():
        folders = camera_folders(path)
        named = {camera: name.removesuffix("_json") for camera, name in (named or {}).items()}
        key_of = _match_cameras(str(path), cameras, list(folders), named)
        tables, notes, said = {}, [], set()
        for camera, name in key_of.items():
            tables[camera], n_people, own = read_folder(folders[name], person)
            said |= own
            if n_people > 1:
                which = "the one detected most surely" if person is None else f"number {person} of each"
                notes.append(f"{camera}: up to {n_people} people in an image; took {which}")
        return _detections(str(path), tables, said, skeleton, notes=tuple(notes))
    try:
        arrays = read_arrays(path)
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror or error}); give a .npz or a folder") from None
    except ValueError:
        raise CalibrationError(
            f"{path} is not a .npz of numbers; expected one array (frames, points, 3) a camera"
        ) from None
    said = {str(arrays.pop(_SKELETON))} if _names_skeleton(arrays) else set()
    key_of = _match_cameras(path.name, cameras, list(arrays), named or {})
    return _detections(path.name, {camera: arrays[name] for camera, name in key_of.items()}, said, skeleton)


def camera_names(path: Path) -> tuple[str, ...]:
    """Return the names of all cameras in a file or folder of detections. Raises CalibrationError."""
    if path.is_dir():
        return tuple(camera_folders(path))
    try:
        arrays = read_arrays(path)
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path} is not a .npz of numbers ({error}); give a .npz or a folder") from None
    return tuple(name for name in arrays if name != _SKELETON or not _names_skeleton(arrays))


def _names_skeleton(arrays: Mapping[str, NDArray]) -> bool:
    """Say whether a file's arrays hold the skeleton's name, and not a camera called so."""
    return _SKELETON in arrays and arrays[_SKELETON].dtype.kind == "U" and arrays[_SKELETON].size == 1


def write_detections(path: Path, detections: Detections, *, as_folder: bool = False) -> None:
    """Write detections as `.npz`, or as a folder of OpenPose JSON, with the name of their skeleton.

    Raises CalibrationError where the points are no network's.
    """
    n_points = len(detections.points)
    names = [each.name for each in SKELETONS.values() if (each.n_points, each.points) == (n_points, detections.points)]
    if not names:
        raise CalibrationError(
            f"{n_points} points ({', '.join(detections.points[:3])}, ...) are not a pose network's; "
            "write a table (.csv)"
        )
    tables = {
        camera: np.concatenate([detections.px[:, :, k], detections.visibility[:, :, k, None]], axis=-1)
        for k, camera in enumerate(detections.cameras)
    }
    if as_folder:
        write_folders(path, tables, names[0])
    else:
        write_arrays(path, {**tables, _SKELETON: np.array(names[0])})


def _match_cameras(where: str, cameras: Sequence[str], keys: Sequence[str], named: Mapping[str, str]) -> dict[str, str]:
    """Return the key of every camera: as named, of the same name, or the only one that ends in the same number."""
    key_of = {}
    for camera in cameras:
        wanted = named.get(camera, camera)
        alike = [key for key in keys if number_at_end(key) == number_at_end(camera) is not None]
        rivals = [name for name in cameras if number_at_end(name) == number_at_end(camera)]
        if wanted in keys:
            key_of[camera] = wanted
        elif camera not in named and len(alike) == len(rivals) == 1:
            key_of[camera] = alike[0]
        else:
            raise CalibrationError(
                f"{where} holds no detections of '{wanted}'; it has: {', '.join(keys)[:200] or 'none'}; "
                f'say which are whose with detections_cameras = {{{camera} = "..."}}'
            )
    return key_of


def _detections(
    where: str, tables: Mapping[str, Array], said: set[str], skeleton: str | None, *, notes: tuple[str, ...] = ()
) -> Detections:
    """Stack the cameras' tables (frames, points, 3); shorter ones are padded with NaN."""
    if not tables:
        raise CalibrationError(
            f"{where} holds no detections; expected a folder of OpenPose JSON for each camera, or .npz"
        )
    n_points = {}
    for camera, table in tables.items():
        if table.ndim != 3 or table.shape[2] != 3 or not np.issubdtype(table.dtype, np.number) or not table.size:
            raise CalibrationError(
                f"{where}: the detections of '{camera}' are {table.dtype} {table.shape}; "
                "expected numbers (frames, points, 3): x, y, visibility"
            )
        n_points[camera] = table.shape[1]
    count, known = max(n_points.values()), list(dict.fromkeys(each.n_points for each in SKELETONS.values()))
    if len(set(n_points.values())) > 1 or count not in known:
        counts = ", ".join(f"{camera} {n}" for camera, n in n_points.items())
        expected = ", ".join(map(str, known))
        raise CalibrationError(f"{where}: points per image: {counts}; expected the same for all, one of {expected}")
    names = choose_skeleton(where, count, said, skeleton).points
    values = np.full((max(map(len, tables.values())), len(names), len(tables), 3), np.nan)
    for column, table in enumerate(tables.values()):
        values[: len(table), :, column] = table[:, : len(names)]
    is_seen = np.isfinite(values).all(axis=-1) & (values[..., 2] > 0)
    _refuse_shares(where, values[..., :2][is_seen])
    values = np.where(is_seen[..., None], values, np.nan)
    visibility = np.clip(np.where(is_seen, values[..., 2], 0.0), 0.0, 1.0)
    return Detections(cameras=tuple(tables), points=names, px=values[..., :2], visibility=visibility, notes=notes)


def _refuse_shares(where: str, px: Array) -> None:
    """Raise CalibrationError where seen points (n, 2) are shares of an image."""
    if not len(px) or px.max() == px.min():
        return
    least, most = _OF_SHARES
    if least <= px.min() and px.max() <= most:
        raise CalibrationError(
            f"{where}: all coordinates lie within {px.min():.2f} to {px.max():.2f}, as shares of the image do; "
            "expected pixels: multiply x by the image's width and y by its height"
        )


def landmarks_from_points(names: Sequence[str], points: Array) -> dict[str, Array]:
    """Return points (..., points, 3) [m] by name, and the landmarks interpolated between them, each (..., 3).

    Without keypoints of their own, the head is midway between the ears, the middle of the hand between the knuckles of
    the first and the last finger, the ball of the foot three quarters of the way from heel to toes, or to the big toe
    alone. NaN where keypoints that it needs are NaN; left out where the set has no such keypoint.
    """
    landmarks = {name: points[..., i, :] for i, name in enumerate(names)}
    for landmark in [each for each in LANDMARK_RECIPES if each not in landmarks]:
        for recipe in LANDMARK_RECIPES[landmark]:
            if set(recipe) <= set(names):
                between = points[..., [names.index(name) for name in recipe], :]
                found = np.einsum("...pi,p->...i", between, np.array(list(recipe.values())))
                known = landmarks.get(landmark)
                landmarks[landmark] = found if known is None else np.where(np.isnan(known), found, known)
    return landmarks
