"""Takes: a body's motion as motion-capture programs want it, frame by frame at one rate; gaps stay gaps."""

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
from airborne.export.stick_figure import stick_figure
from airborne.geometry.rotations import angles_from_matrix, matrix_from_angles, unwrapped
from airborne.motion import Motion, PlayersMotion
from airborne.motion.joints import continuous_angles

Array = NDArray[np.floating]

AXIS_MARKER_M = 0.1  # how far the added markers lie from the root's origin
MOST_FRAMES = 2_000_000
FARTHEST_M = 1e6
_LONGEST_NAME = 60
_LARGEST_DENOMINATOR = 1001  # 60000/1001 frames per second and its kin


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
    markers: tuple[str, ...]  # plain names; those of the model's landmarks, and maybe more
    points: Array  # (n, markers, 3) world [m], as measured
    sd: Array  # (n, markers) root mean square over the axes [m]; infinite where unseen, NaN where unknown
    position: Array  # (n, 3) of the root, world [m]
    turns: Array  # (n, 3) somersault, tilt, twist of the root, running on over time [rad]
    joint_angles: Array  # (n, segments - 1, 3) x-y-z, running on over time [rad]

    def __post_init__(self) -> None:
        far_m = max(np.nanmax(np.abs(places), initial=0.0) for places in (self.points, self.position))
        if far_m > FARTHEST_M:
            raise ResultError(f"the run places something {far_m:.3g} m from the origin; mend it or track again")

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def has_pose(self) -> NDArray[np.bool_]:
        """In which frames the whole pose is known: (n,)."""
        known = np.isfinite(self.position).all(axis=1) & np.isfinite(self.turns).all(axis=1)
        return np.asarray(known & np.isfinite(self.joint_angles).all(axis=(1, 2)))

    @property
    def R(self) -> Array:
        """World from root: (n, 3, 3)."""
        return matrix_from_angles(self.turns)

    @property
    def stray_s(self) -> float:
        """How far the times stray from the even beat of the rate, at most [s]."""
        beat = self.time_s[0] + np.arange(len(self)) / float(self.rate)
        return float(np.abs(self.time_s - beat).max())

    def stretches(self) -> list[slice]:
        """Return the runs of frames with a whole pose, in order."""
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
        markers=plain_names([landmark.name for landmark in model.landmarks]),
        rate=grid.rate,
        frame=grid.frame,
        time_s=grid.time_s,
        points=grid.spread(points),
        sd=grid.spread(sd),
        position=grid.spread(motion.position),
        turns=grid.spread(unwrapped(angles_from_matrix(motion.R), motion.time_s)),
        joint_angles=grid.spread(continuous_angles(motion)),
    )


def with_axis_markers(model: BodyModel) -> BodyModel:
    """Add landmarks 0.1 m along the root's axes where its own, and the joints on it, do not show how it is turned."""
    root = model.segments[0].name
    joints = [segment.joint_m for segment in model.segments[1:] if segment.parent == root]
    fixed = [landmark.position_m for landmark in model.landmarks if landmark.segment == root]
    spread = np.array([*fixed, *joints]).reshape(-1, 3)
    if len(spread) and np.linalg.matrix_rank(spread - spread[0], tol=1e-3) >= 2:
        return model
    taken = {landmark.name for landmark in model.landmarks}
    names = [f"{root}_axis_{axis}" for axis in "xyz"]
    added = [Landmark(n, root, AXIS_MARKER_M * e) for n, e in zip(names, np.eye(3), strict=True) if n not in taken]
    return replace(model, landmarks=(*model.landmarks, *added))


def player_takes(motion: PlayersMotion) -> list[Take]:
    """Return a take of each player that was found at all; its markers are the joints as tracked.

    Its model is a figure of sticks, see `stick_figure`. Raises ResultError where there are no hips, knees and ankles,
    or fewer than two frames.
    """
    grid, takes = _Grid.of(motion.index, motion.time_s), []
    for k, name in enumerate(plain_names(motion.players)):
        if not np.isfinite(motion.points[:, k]).any():
            continue
        figure = stick_figure(motion.points[:, k], motion.joints)
        take = Take(
            name=name,
            model=figure.model,
            markers=plain_names(motion.joints),
            rate=grid.rate,
            frame=grid.frame,
            time_s=grid.time_s,
            points=grid.spread(motion.points[:, k]),
            sd=grid.spread(motion.sd[:, k]),
            position=grid.spread(figure.position),
            turns=grid.spread(unwrapped(figure.turns, motion.time_s)),
            joint_angles=grid.spread(_running_on(figure.joint_angles, motion.time_s)),
        )
        takes.append(take)
    return takes


def plain_names(names: Sequence[str]) -> tuple[str, ...]:
    """Write names in letters, digits, _ . and - alone, each its own, 60 at most: what every program can read."""
    found: list[str] = []
    for name in names:
        letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", letters).strip("_.-")[:_LONGEST_NAME] or "unnamed"
        number, unique = 2, plain
        while unique in found:
            number, unique = number + 1, f"{plain}_{number}"
        found.append(unique)
    return tuple(found)


def part_paths(path: Path, n: int) -> list[Path]:
    """Name the files of n unbroken stretches: `path` alone, or `<stem>_part1<suffix>` and so on; remove older ones."""
    for old in [path, *path.parent.iterdir()]:
        if re.fullmatch(re.escape(path.stem) + r"(_part\d+)?" + re.escape(path.suffix), old.name):
            old.unlink(missing_ok=True)
    return [path] if n == 1 else [path.with_name(f"{path.stem}_part{k + 1}{path.suffix}") for k in range(n)]


def rate_of(index: NDArray[np.int64], time_s: Array) -> Fraction:
    """Find how many numbers pass in a second, as the fraction that it is: 60000/1001 rather than 59.94."""
    rate = float(index[-1] - index[0]) / float(time_s[-1] - time_s[0])
    simple = Fraction(rate).limit_denominator(_LARGEST_DENOMINATOR)
    return simple if abs(float(simple) / rate - 1) < 1e-9 else Fraction(rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Grid:
    """Evenly numbered frames, and which of them the rows of a table are."""

    rate: Fraction
    frame: NDArray[np.int64]
    time_s: Array
    rows: NDArray[np.int64]

    @classmethod
    def of(cls, index: NDArray[np.int64], time_s: Array) -> _Grid:
        """Give every row its place among evenly numbered frames; raises ResultError for fewer than two."""
        if len(index) < 2:
            raise ResultError(f"the run holds {len(index)} frame(s); an export needs two or more; track longer")
        step = int(np.gcd.reduce(np.diff(index)))
        rows = (index - index[0]) // step
        n = int(rows[-1]) + 1
        if n > MOST_FRAMES:
            raise ResultError(f"the run's frames are numbered up to {index[-1]}, over {MOST_FRAMES:,} apart; mend them")
        if not (np.diff(time_s) > 0).all():
            raise ResultError("the times of the run do not grow from row to row; mend time_s")
        times = np.interp(np.arange(n), rows, time_s)
        first = int(index[0]) // step + 1
        return cls(rate=rate_of(rows, time_s), frame=np.arange(first, first + n), time_s=times, rows=rows)

    def spread(self, values: Array) -> Array:
        """Put rows (r, ...) in their places of (n, ...); the others are NaN."""
        spread = np.full((len(self.frame), *values.shape[1:]), np.nan)
        spread[self.rows] = values
        return spread


def _running_on(angles: Array, time_s: Array) -> Array:
    return np.stack([unwrapped(angles[:, j], time_s) for j in range(angles.shape[1])], axis=1)
