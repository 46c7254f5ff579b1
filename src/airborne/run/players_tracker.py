"""The tracker of a trial's players: its method, starts checked against the cameras, torsos from a table or tracked."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from pathlib import Path

import numpy as np

from airborne.cameras import Rig, camera_looking_at
from airborne.errors import TrialError
from airborne.io.text import read_text
from airborne.run.landmarks import read_joint_positions, triangulate_clicks
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.start_check import MOST_MISS_M, start_misses_m
from airborne.tracking.particle import GivenTorsos, legs_tracker
from airborne.tracking.players import PlayerStart, PlayersTracker
from airborne.trial.file import Trial
from airborne.trial.players import start_of
from airborne.trial.settings import ParticleSettings
from airborne.trial.start import ONLY_BYSTANDERS
from airborne.types import Array
from airborne.video import Frames, View

_CLEARLY = 0.5  # cosine of lines from right to left; chosen so that a pelvis may turn 60 degrees over the legs
_LEAST_APART_M = 0.15  # chosen: the middles of two trunks, each 0.2 m deep or more, are farther from each other
_MOST_ABOVE_FLOOR_M = 0.25  # of the lower ankle; chosen: twice as high as where people stand, calibrations a few cm off
_AWAY = np.array([0, -4.0, 0])  # of the artificial cameras [m]
_TORSO_COLUMNS = ("player", "frame", "x_m", "y_m", "z_m")
_LARGEST_TABLE_BYTES = 50_000_000  # larger files are refused
_MOST_FRAMES = 1_000_000  # from the first to the last torso


def players_tracker_of(trial: Trial, rig: Rig) -> PlayersTracker:
    """Make the tracker of a trial's players for the cameras `rig`.

    Raises TrialError for a player whom no camera sees at the start, where there are only bystanders, and for an
    unusable table of torsos.
    """
    starts = player_starts(trial, rig)
    if not any(start.has_legs for start in starts):
        raise TrialError(f"{trial.name}: {ONLY_BYSTANDERS}")
    for start in starts:
        _check_visible(trial, start, rig)
    if not isinstance(trial.track, ParticleSettings):
        return Blocker(starts)
    torso = None if trial.torso is None else read_torsos(trial.path(trial.torso), starts, first=trial.start.frame)
    return legs_tracker(trial.track.filter, rig, starts, torso)


def player_starts(trial: Trial, rig: Rig) -> tuple[PlayerStart, ...]:
    """Return where every player and bystander starts; what was clicked is triangulated.

    Raises TrialError for points that cannot be a player's, or fewer than two cameras see, and for two in one place.
    """
    starts = []
    for player in trial.start.player:
        if player.joints_m is not None:
            names, points = read_joint_positions(trial, player.joints_m)
        else:
            assert player.points_px is not None, "checked with the table"
            names, points = triangulate_clicks(trial, player.points_px, rig, f"player '{player.name}'")
        try:
            starts.append(start_of(player.name, dict(zip(names, points.tolist(), strict=True))))
        except ValueError as error:
            raise TrialError(f"{trial.name}: player '{player.name}': {error}") from None
    _check_apart(trial, starts)
    return tuple(starts)


def _check_apart(trial: Trial, starts: Sequence[PlayerStart]) -> None:
    """Raise TrialError where two players or bystanders are in one place."""
    for one, other in combinations(starts, 2):
        if np.linalg.norm(one.joints_m["torso"] - other.joints_m["torso"]) < _LEAST_APART_M:
            raise TrialError(
                f"{trial.name}: players '{one.name}' and '{other.name}' are in one place; is it the same player twice? "
                "Remove one, or correct its joints"
            )


def start_notes(starts: Sequence[PlayerStart]) -> list[str]:
    """Say of each player of whose hips, knees and ankles one pair points against both others that it may be crossed."""
    notes = []
    for start in starts:
        if not start.has_legs:
            continue
        pairs = {
            f"{part}s": start.joints_m[f"{part}_left"] - start.joints_m[f"{part}_right"]
            for part in ("hip", "knee", "ankle")
        }
        for part, across in pairs.items():
            (a, along_a), (b, along_b) = (other for other in pairs.items() if other[0] != part)
            if (
                max(_cosine(across, along_a), _cosine(across, along_b))
                < -_CLEARLY
                < _CLEARLY
                < _cosine(along_a, along_b)
            ):
                notes.append(
                    f"player '{start.name}': the {part} point the other way than {a} and {b}; legs that cross, or left "
                    "and right exchanged there?"
                )
    return notes


def doubt_starts(starts: Sequence[PlayerStart], first: Frames | None) -> dict[str, str]:
    """Say whose start cannot be believed, by the players' names: in the air, or elsewhere than the first images show.

    first: None where no image is looked at.
    """
    with_legs = [start for start in starts if start.has_legs]
    misses_m = np.full(len(with_legs), np.nan) if first is None else start_misses_m(with_legs, first)
    doubts = {}
    for start, miss_m in zip(with_legs, misses_m, strict=True):
        over_m = min(start.joints_m["ankle_left"][2], start.joints_m["ankle_right"][2])
        if over_m > _MOST_ABOVE_FLOOR_M:
            doubts[start.name] = (
                f"both ankles lie {over_m:.2f} m or more over the floor, z = 0, so no frame "
                "counts as tracked: start where the player stands, or correct the joints or the floor"
            )
        elif miss_m > MOST_MISS_M:
            doubts[start.name] = (
                f"the images of the first frame show hips, knees and ankles "
                f"{100 * miss_m:.0f} cm from where [[start.player]] has them, so no frame counts as tracked: are they "
                "of this frame and player, and at the right height?"
            )
    return doubts


def list_doubts(doubts: Mapping[str, str]) -> list[str]:
    """Return doubts of players' starts as sentences of their own, each with its player."""
    return [f"player '{name}': {doubt}" for name, doubt in doubts.items()]


def _cosine(a: Array, b: Array) -> float:
    return float(a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-9))


def compile_kernels(trial: Trial) -> None:
    """Take two steps on empty images, so that the tracker's kernels are compiled before live frames arrive.

    Not where players are clicked or in tables: their places need the cameras, which are not there yet.
    """
    given = [player.joints_m for player in trial.start.player if isinstance(player.joints_m, dict)]
    if len(given) < len(trial.start.player):
        return
    at = np.mean([point for joints_m in given for point in joints_m.values()], axis=0)
    size = (640, 480)
    asides = zip(trial.camera, np.linspace([-1, 0, 0], [1, 0, 0], len(trial.camera)), strict=True)
    cameras = [
        camera_looking_at(camera.name, at + aside + _AWAY, at + aside, focal_px=400.0, size=size)
        for camera, aside in asides
    ]
    tracker, grey = players_tracker_of(trial, Rig(tuple(cameras))), np.full((size[1], size[0], 3), 128, np.uint8)
    state = tracker.init()
    for index in range(2):
        views = tuple(View(camera, grey) for camera in cameras)
        state, _ = tracker.step(state, Frames(index, Fraction(index, 60), views))


def read_torsos(path: Path, starts: Sequence[PlayerStart], *, first: int) -> GivenTorsos:
    """Read the torsos of all players and bystanders: a table `player,frame,x_m,y_m,z_m`, in any order of its rows.

    Of a joints.csv, which also has a column `joint`, the rows of the torso are read. A frame without a row keeps the
    torso of the frame before. Raises TrialError where the table cannot be read or a player has no row at frame `first`.
    """
    names = [start.name for start in starts]
    torsos: dict[tuple[int, str], tuple[float, float, float]] = {}
    try:
        rows = csv.DictReader(read_text(path, _LARGEST_TABLE_BYTES).splitlines())
        missing = [name for name in _TORSO_COLUMNS if name not in (rows.fieldnames or ())]
        if missing:
            raise TrialError(f"{path.name}: no column {', '.join(missing)}; expected {', '.join(_TORSO_COLUMNS)}")
        for row in rows:
            if row.get("joint", "torso") == "torso" and row["player"] in names:
                x, y, z = (float(row[axis] or math.nan) for axis in _TORSO_COLUMNS[2:])
                frame = int(row["frame"])
                if not abs(frame - first) <= _MOST_FRAMES:
                    raise ValueError(f"frame {str(frame)[:20]} lies far beyond the recording")
                torsos[frame, row["player"]] = (x, y, z)
    except (OSError, ValueError, TypeError, csv.Error) as error:
        raise TrialError(f"{path.name}: not a table of torsos ({error}); correct it or leave `torso` out") from error
    positions = np.full((max((frame for frame, _ in torsos), default=first) - first + 1, len(names), 3), np.nan)
    for (frame, name), torso in torsos.items():
        if frame >= first:
            positions[frame - first, names.index(name)] = torso
    missing = [name for name, torso in zip(names, positions[0], strict=True) if not np.isfinite(torso).all()]
    if missing:
        raise TrialError(f"{path.name}: no torso of {', '.join(missing)} at frame {first}, where tracking starts")
    return GivenTorsos(positions, first)


def _check_visible(trial: Trial, start: PlayerStart, rig: Rig) -> None:
    """Raise TrialError where no camera sees any point of a player; a bystander may be out of sight."""
    if not start.has_legs:
        return
    points = np.array(list(start.joints_m.values()))
    for camera in rig:
        px = camera.without_distortion().px_from_world(points)
        if np.any(np.all((px >= -0.5) & (px <= np.array(camera.size) - 0.5), axis=-1)):
            return
    raise TrialError(
        f"{trial.name}: player '{start.name}' lies in no camera's image; joints_m are metres in the world of the "
        "calibration"
    )
