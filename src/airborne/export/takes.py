"""Takes: a body's motion for motion-capture programs, frame by frame at one rate; gaps stay gaps."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Landmark
from airborne.errors import ResultError
from airborne.export.stick_figure import fit_stick_figure
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles, unwrap
from airborne.motion import Motion, PlayersMotion
from airborne.motion.joints import continuous_angles
from airborne.types import Array

_AXIS_MARKER_M = 0.1  # distance of the added markers from the root's origin
_MOST_FRAMES = 2_000_000  # of a run: nine hours at 60 a second
FARTHEST_M = 1e6  # from the origin: a typing error beyond it
_LONGEST_NAME = 60  # characters of a file name
_LARGEST_DENOMINATOR = 1001  # 60000/1001 frames per second and similar rates


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Take:
    """One body's motion on evenly numbered frames; NaN where nothing is known.

    Frame k of a file is the run's frame k - 1; where only every n-th was tracked, its frame n (k - 1).
    """

    name: str  # of the body among others, letters and digits; "" where it is the only one
    model: BodyModel
    rate: Fraction  # frames per second
    frame: NDArray[np.int64]  # (n,) consecutive, the recording's first is 1
    time_s: Array  # (n,) [s]
    markers: tuple[str, ...]  # plain names; those of the model's landmarks, and perhaps more
    points: Array  # (n, markers, 3) world [m], as measured
    sd: Array  # (n, markers) root mean square over the axes [m]; infinite where unobservable, NaN where unknown
    position: Array  # (n, 3) of the root, world [m]
    root_angles: Array  # (n, 3) somersault, tilt, twist of the root, unwrapped over time [rad]
    joint_angles: Array  # (n, segments - 1, 3) x-y-z, unwrapped over time [rad]

    def __post_init__(self) -> None:
        far_m = max(np.nanmax(np.abs(points), initial=0.0) for points in (self.points, self.position))
        if far_m > FARTHEST_M:
            raise ResultError(f"the run holds a point {far_m:.3g} m from the origin; correct it or track again")

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def has_pose(self) -> NDArray[np.bool_]:
        """In which frames the pose is complete: (n,)."""
        is_complete = np.isfinite(self.position).all(axis=1) & np.isfinite(self.root_angles).all(axis=1)
        return np.asarray(is_complete & np.isfinite(self.joint_angles).all(axis=(1, 2)))

    @property
    def R(self) -> Array:
        """World from root: (n, 3, 3)."""
        return matrix_from_angles(self.root_angles)

    @property
    def jitter_s(self) -> float:
        """Jitter: the largest deviation of the times from uniform sampling at the rate [s]."""
        uniform = self.time_s[0] + np.arange(len(self)) / float(self.rate)
        return float(np.abs(self.time_s - uniform).max())

    def stretches(self) -> list[slice]:
        """Return the stretches of frames with a complete pose, in order."""
        edges = np.diff(np.concatenate([[0], self.has_pose.astype(np.int8), [0]]))
        return [slice(int(a), int(b)) for a, b in zip(*(np.flatnonzero(edges == s) for s in (1, -1)), strict=True)]


def body_take(motion: Motion, model: BodyModel, points: Array, sd: Array) -> Take:
    """Return the take of one body; points (n, landmarks, 3) and sd (n, landmarks) [m] as `landmarks` gives them.

    Raises ResultError for fewer than two frames.
    """
    grid = _Grid.of(motion.index, motion.time_s)
    return Take(
        name="",
        model=model,
        markers=portable_names([landmark.name for landmark in model.landmarks]),
        rate=grid.rate,
        frame=grid.frame,
        time_s=grid.time_s,
        points=grid.expand(points),
        sd=grid.expand(sd),
        position=grid.expand(motion.position),
        root_angles=grid.expand(unwrap(angles_from_matrix(motion.R), motion.time_s)),
        joint_angles=grid.expand(continuous_angles(motion)),
    )


def with_axis_markers(model: BodyModel) -> BodyModel:
    """Add landmarks 0.1 m along the root's axes where its own landmarks and joints do not determine its orientation."""
    root = model.segments[0].name
    joints = [segment.joint_m for segment in model.segments[1:] if segment.parent == root]
    fixed = [landmark.position_m for landmark in model.landmarks if landmark.segment == root]
    points = np.array([*fixed, *joints]).reshape(-1, 3)
    if len(points) and np.linalg.matrix_rank(points - points[0], tol=1e-3) >= 2:
        return model
    taken = {landmark.name for landmark in model.landmarks}
    names = [f"{root}_axis_{axis}" for axis in "xyz"]
    added = [Landmark(n, root, _AXIS_MARKER_M * e) for n, e in zip(names, np.eye(3), strict=True) if n not in taken]
    return replace(model, landmarks=(*model.landmarks, *added))


def player_takes(motion: PlayersMotion) -> list[Take]:
    """Return a take of each player who was ever found; its markers are the tracked joints.

    Its model is a stick figure, see `fit_stick_figure`. Raises ResultError where there are no hips, knees and ankles,
    or fewer than two frames.
    """
    grid, takes = _Grid.of(motion.index, motion.time_s), []
    for k, name in enumerate(portable_names(motion.players)):
        if not np.isfinite(motion.points[:, k]).any():
            continue
        figure = fit_stick_figure(motion.points[:, k], motion.joints)
        take = Take(
            name=name,
            model=figure.model,
            markers=portable_names(motion.joints),
            rate=grid.rate,
            frame=grid.frame,
            time_s=grid.time_s,
            points=grid.expand(motion.points[:, k]),
            sd=grid.expand(motion.sd[:, k]),
            position=grid.expand(figure.position),
            root_angles=grid.expand(unwrap(figure.root_angles, motion.time_s)),
            joint_angles=grid.expand(_unwrap_joints(figure.joint_angles, motion.time_s)),
        )
        takes.append(take)
    return takes


def portable_names(names: Sequence[str]) -> tuple[str, ...]:
    """Rewrite names in ASCII letters, digits, _ . and - only, unique, 60 characters at most, for every program."""
    rewritten: list[str] = []
    for name in names:
        letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", letters).strip("_.-")[:_LONGEST_NAME] or "unnamed"
        number, unique = 2, plain
        while unique in rewritten:
            number, unique = number + 1, f"{plain}_{number}"
        rewritten.append(unique)
    return tuple(rewritten)


def part_paths(path: Path, n: int) -> list[Path]:
    """Name the files of n unbroken stretches: `path` alone, or `<stem>_part1<suffix>` and so on; remove older ones."""
    for old in [path, *path.parent.iterdir()]:
        if re.fullmatch(re.escape(path.stem) + r"(_part\d+)?" + re.escape(path.suffix), old.name):
            old.unlink(missing_ok=True)
    return [path] if n == 1 else [path.with_name(f"{path.stem}_part{k + 1}{path.suffix}") for k in range(n)]


def sampling_rate(index: NDArray[np.int64], time_s: Array) -> Fraction:
    """Return the number of frames per second as an exact fraction: 60000/1001 rather than 59.94."""
    rate = float(index[-1] - index[0]) / float(time_s[-1] - time_s[0])
    simple = Fraction(rate).limit_denominator(_LARGEST_DENOMINATOR)
    return simple if abs(float(simple) / rate - 1) < 1e-9 else Fraction(rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Grid:
    """Evenly numbered frames, and the frame of each row of a table."""

    rate: Fraction
    frame: NDArray[np.int64]
    time_s: Array
    rows: NDArray[np.int64]

    @classmethod
    def of(cls, index: NDArray[np.int64], time_s: Array) -> _Grid:
        """Assign every row to one of evenly numbered frames; raises ResultError for fewer than two."""
        if len(index) < 2:
            raise ResultError(f"the run holds {len(index)} frame(s); an export needs two or more; track longer")
        step = int(np.gcd.reduce(np.diff(index)))
        rows = (index - index[0]) // step
        n = int(rows[-1]) + 1
        if n > _MOST_FRAMES:
            raise ResultError(
                f"the run's frames are numbered up to {index[-1]}, over {_MOST_FRAMES:,} apart; correct them"
            )
        if not (np.diff(time_s) > 0).all():
            raise ResultError("the times of the run do not increase from row to row; correct time_s")
        times = np.interp(np.arange(n), rows, time_s)
        first = int(index[0]) // step + 1
        return cls(rate=sampling_rate(rows, time_s), frame=np.arange(first, first + n), time_s=times, rows=rows)

    def expand(self, values: Array) -> Array:
        """Expand rows (r, ...) to frames (n, ...); frames without a row are NaN."""
        expanded = np.full((len(self.frame), *values.shape[1:]), np.nan)
        expanded[self.rows] = values
        return expanded


def _unwrap_joints(angles: Array, time_s: Array) -> Array:
    return np.stack([unwrap(angles[:, j], time_s) for j in range(angles.shape[1])], axis=1)
