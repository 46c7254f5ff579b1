"""2D detections: a person's keypoints in every camera's images, found by a pose network or clicked.

Keypoints have our own names (`hip_left`, `toe_right`, ...), whichever set the network uses; the set is recognised by
its length: COCO 17, OpenPose's COCO 18, BODY_25, HALPE 26, BlazePose 33, and the first points of COCO-WholeBody 133
and HALPE 136.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.cameras.formats.openpose import camera_folders, number_at_end, read_folder, write_folders
from airborne.errors import CalibrationError
from airborne.io.names import check_name
from airborne.io.npz import read_arrays, write_arrays
from airborne.types import Array


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
    path: Path, cameras: Sequence[str], named: Mapping[str, str] | None = None, *, person: int | None = None
) -> Detections:
    """Read the detections of the cameras from a `.npz` file or a folder of OpenPose JSON.

    `.npz`: one array (frames, points, 3) a camera, x, y [px] and visibility. Folder: `<camera>_json` or `<camera>`
    below it, one file a frame, the frame being the last number of the file's name. An array or folder belongs to a
    camera by `named`, by its name, or by the number that it ends in. Of several people in an image the one with the
    highest confidence is taken, or the one with the index `person` in each file. Raises CalibrationError where a camera
    is missing, or where two people have about the same confidence and `person` does not say which.
    """
    if path.is_dir():
        folders = camera_folders(path)
        named = {camera: name.removesuffix("_json") for camera, name in (named or {}).items()}
        key_of = _match_cameras(str(path), cameras, list(folders), named)
        tables, notes = {}, []
        for camera, name in key_of.items():
            tables[camera], n_people = read_folder(folders[name], person)
            if n_people > 1:
                which = "the one detected most surely" if person is None else f"number {person} of each"
                notes.append(f"{camera}: up to {n_people} people in an image; took {which}")
        return _detections(str(path), tables, tuple(notes))
    try:
        arrays = read_arrays(path)
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror or error}); give a .npz or a folder") from None
    except ValueError:
        raise CalibrationError(
            f"{path} is not a .npz of numbers; expected one array (frames, points, 3) a camera"
        ) from None
    key_of = _match_cameras(path.name, cameras, list(arrays), named or {})
    return _detections(path.name, {camera: arrays[name] for camera, name in key_of.items()})


def camera_names(path: Path) -> tuple[str, ...]:
    """Return the names of all cameras in a file or folder of detections. Raises CalibrationError."""
    if path.is_dir():
        return tuple(camera_folders(path))
    try:
        return tuple(read_arrays(path))
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path} is not a .npz of numbers ({error}); give a .npz or a folder") from None


def write_detections(path: Path, detections: Detections, *, as_folder: bool = False) -> None:
    """Write detections as `.npz`, or as a folder of OpenPose JSON.

    Raises CalibrationError where the points are no network's: a reader tells them by the length of their list.
    """
    names = NETWORKS.get(len(detections.points))
    if names != detections.points:
        raise CalibrationError(
            f"{len(detections.points)} points ({', '.join(detections.points[:3])}, ...) are not a pose network's, "
            "which are told by their number; write a table (.csv)"
        )
    tables = {
        camera: np.concatenate([detections.px[:, :, k], detections.visibility[:, :, k, None]], axis=-1)
        for k, camera in enumerate(detections.cameras)
    }
    if as_folder:
        write_folders(path, tables)
    else:
        write_arrays(path, tables)


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


def _detections(where: str, tables: Mapping[str, Array], notes: tuple[str, ...] = ()) -> Detections:
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
    count = max(n_points.values())
    if len(set(n_points.values())) > 1 or count not in NETWORKS:
        counts = ", ".join(f"{camera} {n}" for camera, n in n_points.items())
        expected = ", ".join(map(str, NETWORKS))
        raise CalibrationError(f"{where}: points per image: {counts}; expected the same for all, one of {expected}")
    names = NETWORKS[count]
    values = np.full((max(map(len, tables.values())), len(names), len(tables), 3), np.nan)
    for column, table in enumerate(tables.values()):
        values[: len(table), :, column] = table[:, : len(names)]
    is_seen = np.isfinite(values).all(axis=-1) & (values[..., 2] > 0)
    values = np.where(is_seen[..., None], values, np.nan)
    visibility = np.clip(np.where(is_seen, values[..., 2], 0.0), 0.0, 1.0)
    return Detections(cameras=tuple(tables), points=names, px=values[..., :2], visibility=visibility, notes=notes)


def landmarks_from_points(names: Sequence[str], points: Array) -> dict[str, Array]:
    """Return points (..., points, 3) [m] by name, and the landmarks interpolated between them, each (..., 3).

    Without keypoints of their own, the head is midway between the ears, the middle of the hand between the knuckles of
    the first and the last finger, the ball of the foot three quarters of the way from heel to toes. NaN where a
    keypoint that it needs is NaN; left out where the set has no such keypoint.
    """
    landmarks = {name: points[..., i, :] for i, name in enumerate(names)}
    for landmark, recipes in LANDMARK_RECIPES.items():
        for recipe in recipes:
            if landmark not in landmarks and set(recipe) <= set(names):
                between = points[..., [names.index(name) for name in recipe], :]
                landmarks[landmark] = np.einsum("...pi,p->...i", between, np.array(list(recipe.values())))
    return landmarks


def _both_sides(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for name in names for side in ("left", "right"))


def _limb(side: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for name in names)


_COCO = ("nose", *_both_sides("eye", "ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle"))
_HALPE = (*_COCO, "head_top", "mid_shoulder", "mid_hip", *_both_sides("toe", "small_toe", "heel"))
_ARM, _LEG, _TOES = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"), ("toe", "small_toe", "heel")
_FACE = ("eye_right", "eye_left", "ear_right", "ear_left")
_RIGHT_FIRST = ("nose", "mid_shoulder", *_limb("right", *_ARM), *_limb("left", *_ARM))
_EYES = (*_limb("left", "inner_eye", "eye", "outer_eye"), *_limb("right", "inner_eye", "eye", "outer_eye"))

NETWORKS: dict[int, tuple[str, ...]] = {
    17: _COCO,
    18: (*_RIGHT_FIRST, *_limb("right", *_LEG), *_limb("left", *_LEG), *_FACE),
    25: (
        *(*_RIGHT_FIRST, "mid_hip", *_limb("right", *_LEG), *_limb("left", *_LEG), *_FACE),
        *(*_limb("left", *_TOES), *_limb("right", *_TOES)),
    ),
    26: _HALPE,
    33: (
        *("nose", *_EYES, *_both_sides("ear", "mouth", "shoulder", "elbow", "wrist")),
        *_both_sides("little_knuckle", "index_knuckle", "thumb", "hip", "knee", "ankle", "heel", "toe"),
    ),
    133: (*_COCO, *_limb("left", *_TOES), *_limb("right", *_TOES)),
    136: _HALPE,
}  # how many points a network keeps -> their names, in its order


def _recipes(side: str) -> dict[str, tuple[dict[str, float], ...]]:
    toe, small, heel = _limb(side, *_TOES)
    return {
        f"hand_{side}": ({f"index_knuckle_{side}": 0.5, f"little_knuckle_{side}": 0.5},),
        f"foot_{side}": ({heel: 0.25, toe: 0.375, small: 0.375}, {heel: 0.25, toe: 0.75}),
    }


LANDMARK_RECIPES: dict[str, tuple[dict[str, float], ...]] = {
    "head": ({"ear_left": 0.5, "ear_right": 0.5},),
    **_recipes("left"),
    **_recipes("right"),
}  # landmark -> shares of the points that it lies between, the first recipe that can be followed
