"""Several players' joints over time, and their table joints.csv: written during a run, read back exactly."""

from __future__ import annotations

import io
import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import LEG_POINTS
from airborne.errors import ResultError, count
from airborne.io.parquet import CAN_WRITE_PARQUET, write_parquet
from airborne.io.writing import explain_full_disk, replace_text
from airborne.motion.tables import cell
from airborne.motion.uncertainty import standard_deviation
from airborne.tracking import Status
from airborne.tracking.players import PlayerEstimate
from airborne.types import Array

if TYPE_CHECKING:
    import pandas as pd

_UPPER = np.triu_indices(3)  # of the covariance of a position
_FARTHEST_M = 1e6  # of a joint: no coordinate beyond it
_POSITION = ("x_m", "y_m", "z_m")
_COVARIANCE = tuple(f"cov_{'xyz'[i]}{'xyz'[j]}_m2" for i, j in zip(*_UPPER, strict=True))
PLAYERS_COLUMNS = ("player", "frame", "time_s", "status", "joint", *_POSITION, "sd_m", *_COVARIANCE, "score", "n_views")
_HEADER = ",".join(PLAYERS_COLUMNS) + "\n"
_TEXTS, _WHOLE = ("player", "status", "joint"), ("frame", "n_views")
_EXPECTED = "expected the joints.csv of a run of players"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlayersMotion:
    """The players' joints over time and their uncertainty; what is lost or unknown is NaN."""

    index: NDArray[np.int64]  # (n,) frame numbers
    time_s: Array  # (n,) [s]
    rate: float  # [frames/s]; NaN for a single frame
    players: tuple[str, ...]
    joints: tuple[str, ...]
    points: Array  # (n, players, joints, 3) [m], world
    covariance: Array  # (n, players, joints, 3, 3) [m²], of each joint on its own
    joint_status: NDArray[np.str_]  # (n, players, joints) values of `Status`
    score: Array  # (n, players) mean log-likelihood [nat]
    n_views: NDArray[np.int64]  # (n, players)

    @classmethod
    def collect(
        cls, steps: Sequence[Sequence[PlayerEstimate]], joints: tuple[str, ...], rate: float | None = None
    ) -> PlayersMotion:
        """Stack the estimates of a run: at each time one per player, always in the same order.

        The rate, if not given, is that of the median time step.
        """
        n, players = len(steps), tuple(estimate.player for estimate in steps[0]) if steps else ()
        shape = (n, len(players))
        time_s = np.array([float(step[0].time_s) for step in steps], float)
        return cls(
            index=np.array([step[0].index for step in steps], np.int64),
            time_s=time_s,
            rate=_rate(time_s) if rate is None else float(rate),
            players=players,
            joints=joints,
            points=np.array([[e.points for e in step] for step in steps], float).reshape(*shape, len(joints), 3),
            covariance=np.array([[e.covariance for e in step] for step in steps], float).reshape(
                *shape, len(joints), 3, 3
            ),
            joint_status=np.array([[e.joint_status for e in step] for step in steps], np.str_).reshape(
                *shape, len(joints)
            ),
            score=np.array([[e.score for e in step] for step in steps], float).reshape(shape),
            n_views=np.array([[e.n_views for e in step] for step in steps], np.int64).reshape(shape),
        )

    def __len__(self) -> int:
        return len(self.index)

    def __repr__(self) -> str:
        return f"<PlayersMotion: {count(len(self), 'frame')}, {', '.join(self.players)}>"

    @property
    def status(self) -> NDArray[np.str_]:
        """Each player's status, the worst of hips, knees and ankles, or of all joints without these: (n, players)."""
        legs = [k for k, name in enumerate(self.joints) if name in LEG_POINTS] or list(range(len(self.joints)))
        return worst_of(self.joint_status[..., legs])

    @property
    def sd(self) -> Array:
        """Standard deviations of the joints, the root mean square of their axes': (n, players, joints) [m]."""
        return np.asarray(standard_deviation(np.diagonal(self.covariance, axis1=-2, axis2=-1).mean(axis=-1)))

    def without_tracked(self, players: Sequence[str] | None = None) -> PlayersMotion:
        """Return the same with what is tracked of these players, or of all, called uncertain."""
        is_meant = np.array([players is None or name in players for name in self.players], bool)
        is_tracked = (self.joint_status == Status.TRACKED.value) & is_meant[:, None]
        return replace(self, joint_status=np.where(is_tracked, Status.UNCERTAIN.value, self.joint_status))

    def count(self, player: str, status: Status) -> int:
        """Count the frames in which a player has a status."""
        return int(np.sum(self.status[:, self.players.index(player)] == status.value))


def worst_of(status: NDArray[np.str_]) -> NDArray[np.str_]:
    """Return the status (...) that can be trusted least of several (..., n)."""
    statuses = np.array([each.value for each in Status])
    return statuses[(status[..., None] == statuses).argmax(axis=-1).max(axis=-1)]


class PlayersWriter:
    """Appends the players of one time to joints.csv; the rows are flushed before the next time begins.

    A killed run leaves whole times and at most a torn last one, which `read_players` drops. With `resume` the existing
    rows stay, and what is appended must equal them until they end.
    """

    def __init__(self, path: Path, joints: tuple[str, ...], *, resume: bool = False) -> None:
        """Start a new file, or with `resume` compare with its finished rows first."""
        self.path = path
        self._joints = joints
        self._n_finished_bytes = _whole_lines_end(path) if resume and path.exists() else 0
        self._file = path.open("r+b" if self._n_finished_bytes else "wb")
        self._file.truncate(self._n_finished_bytes)
        self._write(_HEADER, "its first line")

    def __enter__(self) -> PlayersWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def append(self, step: Sequence[PlayerEstimate]) -> None:
        """Write every player at one time.

        Raises ResultError where the file to resume differs at that time.
        """
        self._write("".join(_lines(PlayersMotion.collect([step], self._joints))), f"frame {step[0].index}")

    def _write(self, text: str, name: str) -> None:
        data, offset = text.encode(), self._file.tell()
        if offset < self._n_finished_bytes:
            existing = self._file.read(len(data))
            if existing == data[: len(existing)] and len(existing) == min(len(data), self._n_finished_bytes - offset):
                data = data[len(existing) :]  # of a torn time, only what is missing
            else:
                raise ResultError(
                    f"{self.path} differs from this run in {name}, so another program or machine wrote "
                    "it; track into a new folder"
                )
        if data:
            self._file.seek(offset + len(text.encode()) - len(data))
            with explain_full_disk(self.path):
                self._file.write(data)
                self._file.flush()


def read_players(path: Path) -> PlayersMotion:
    """Read a joints.csv of several players, with exactly the floats that were written.

    The last time is dropped where some of its rows are missing. Raises ResultError in one line for a file that is
    missing, not a joints.csv of players, or without a finished time.
    """
    n_bytes = _whole_lines_end(path)
    if not n_bytes:
        raise ResultError(f"{path} is empty; {_EXPECTED}; track again")
    table = _table(path, n_bytes)
    frame = table["frame"].to_numpy()
    ends = np.flatnonzero(np.diff(frame)) + 1
    n_rows = int(ends[0]) if len(ends) else len(frame)
    if not len(frame):
        raise ResultError(f"{path} holds no finished frame; track again")
    names, joints = (np.array(table[name].iloc[:n_rows], np.str_) for name in ("player", "joint"))
    players = tuple(dict.fromkeys(names.tolist()))
    n, n_joints = len(frame) // n_rows, n_rows // len(players)
    table = table.iloc[: n * n_rows]
    _check_order(path, table, frame[: n * n_rows].reshape(n, n_rows), n_joints)
    numbers = {
        name: table[name].to_numpy().reshape(n, len(players), n_joints)
        for name in PLAYERS_COLUMNS
        if name not in _TEXTS
    }
    covariance = np.empty((n, len(players), n_joints, 3, 3))
    for name, i, j in zip(_COVARIANCE, *_UPPER, strict=True):
        covariance[..., i, j] = covariance[..., j, i] = numbers[name]
    time_s = numbers["time_s"][:, 0, 0]
    return PlayersMotion(
        index=numbers["frame"][:, 0, 0],
        time_s=time_s,
        rate=_rate(time_s),
        players=players,
        joints=tuple(joints[:n_joints].tolist()),
        points=np.stack([numbers[name] for name in _POSITION], axis=-1),
        covariance=covariance,
        joint_status=np.array(table["status"], np.str_).reshape(n, len(players), n_joints),
        score=numbers["score"][..., 0],
        n_views=numbers["n_views"][..., 0],
    )


def write_players(path: Path, motion: PlayersMotion) -> None:
    """Write a whole joints.csv anew, in the place of what is there."""
    replace_text(path, "".join([_HEADER, *_lines(motion)]))


def write_players_parquet(path: Path, table_csv: Path) -> None:
    """Write the table of a joints.csv as Parquet, with its units in the metadata; empty cells become null.

    Without *pyarrow* nothing is written.
    """
    if not CAN_WRITE_PARQUET:
        return
    table = _table(table_csv, _whole_lines_end(table_csv))
    units = (
        {"time_s": "s", "sd_m": "m", "score": "nat"} | dict.fromkeys(_POSITION, "m") | dict.fromkeys(_COVARIANCE, "m2")
    )
    columns = {str(name): column for name, column in table.items()}
    write_parquet(path, columns, units, {"world": "metres, z up", "cov": "of each joint for itself"})


def _lines(motion: PlayersMotion) -> list[str]:
    """Lay out the rows of all times."""
    lines = []
    upper = motion.covariance[..., *_UPPER]
    numbers = np.concatenate([motion.points, motion.sd[..., None], upper], axis=-1).tolist()
    for n, time_s in enumerate(motion.time_s.tolist()):
        for p, player in enumerate(motion.players):
            shared = [player, str(motion.index[n]), cell(time_s)]
            ends = [cell(float(motion.score[n, p])), str(motion.n_views[n, p])]
            for j, joint in enumerate(motion.joints):
                own = [str(motion.joint_status[n, p, j]), joint, *map(cell, numbers[n][p][j])]
                lines.append(",".join([*shared, *own, *ends]) + "\n")
    return lines


def _whole_lines_end(path: Path) -> int:
    """Return the offset at which the last whole line ends."""
    try:
        with path.open("rb") as file:
            end = file.seek(0, 2)
            start = max(end - 4096, 0)
            file.seek(start)
            return start + file.read().rfind(b"\n") + 1 if end else 0
    except OSError as error:
        raise ResultError(f"{path} cannot be read ({error.strerror}); {_EXPECTED}") from error


def _table(path: Path, n_bytes: int) -> pd.DataFrame:
    import pandas as pd

    types: dict[Hashable, Any] = {
        name: "category" if name in _TEXTS else int if name in _WHOLE else float for name in PLAYERS_COLUMNS
    }
    with path.open("rb") as file:
        data = file.read(n_bytes)
    header = data[: data.find(b"\n")].decode(errors="replace").strip()
    if header != ",".join(PLAYERS_COLUMNS):
        lacking = [name for name in PLAYERS_COLUMNS if name not in header.split(",")]
        problem = (
            f"has no column {', '.join(lacking[:3])}" if lacking else "has columns of other names or another order"
        )
        raise ResultError(f"{path} {problem}; {_EXPECTED}; track again")
    unknown = {name: [""] for name in PLAYERS_COLUMNS if name not in _TEXTS}
    try:
        with np.errstate(invalid="ignore"):
            return pd.read_csv(
                io.BytesIO(data), dtype=types, na_values=unknown, keep_default_na=False, low_memory=False
            )
    except (ValueError, OverflowError) as error:
        raise ResultError(f"{path}: {str(error).splitlines()[0][:200]}; correct the line or track again") from None


def _check_order(path: Path, table: pd.DataFrame, frame: NDArray[np.int64], n_joints: int) -> None:
    """Raise ResultError unless every frame has the rows of the first, in the same order, and time increases."""
    codes = (table[name].cat.codes.to_numpy() for name in ("player", "joint"))
    tiled = [np.reshape(each, frame.shape) for each in codes]
    is_regular = all((each == each[0]).all() for each in tiled) and (frame == frame[:, :1]).all()
    n_names = len(set(tiled[0][0].tolist())) * n_joints
    if (table[list(_POSITION)].abs().to_numpy() > _FARTHEST_M).any():
        raise ResultError(f"{path}: a joint is farther than {_FARTHEST_M:g} m; correct the line or track again")
    unknown = set(table["status"].unique()) - {status.value for status in Status}
    if unknown:
        raise ResultError(f"{path}: '{str(unknown.pop())[:40]}' is no status; correct the line or track again")
    if not is_regular or n_names != frame.shape[1] or (np.diff(frame[:, 0]) <= 0).any():
        raise ResultError(f"{path}: the rows of some frame, or their order, differ from the first frame's; track again")


def _rate(time_s: Array) -> float:
    return 1 / float(np.median(np.diff(time_s))) if len(time_s) > 1 else math.nan
