"""What the report's viewer shows at one frame: pictures, the body in 3D, curves; all of it stands in the page."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.errors import ResultError
from airborne.export.film import read_film
from airborne.export.gltf import animation_bytes
from airborne.export.takes import Take, body_take, player_takes
from airborne.motion import Motion, PlayersMotion, joint_angles, root_angles
from airborne.motion.angles import ROOT_ANGLES
from airborne.motion.joints import main_joints
from airborne.motion.players import worst_of
from airborne.motion.run_folder import PICTURES, VIDEOS
from airborne.types import Array

_MOST_ROWS = 5000  # of curves; of a longer run every n-th frame
_MOST_IN_3D = 3000  # frames; a longer run has no body in 3D here
_DIGITS = 5  # of a number

Viewer = dict[str, Any]


def body_viewer(folder: Path, motion: Motion, model: BodyModel) -> Viewer:
    """Return what is shown of a run of one body; of its pictures those that the run's folder has."""
    none = np.empty((len(motion), 0))
    groups = list(_body_groups(motion, model))
    take = _in_3d(motion.index, lambda: [body_take(motion, model, none[..., None].repeat(3, axis=-1), none)])
    return _viewer(folder, motion.index, motion.time_s, motion.status, groups=groups, takes=take)


def players_viewer(folder: Path, motion: PlayersMotion) -> Viewer:
    """Return what is shown of a run of players, of each the heights of hips, knees and ankles."""
    groups = list(_player_groups(motion))
    takes = _in_3d(motion.index, lambda: player_takes(motion))
    return _viewer(folder, motion.index, motion.time_s, worst_of(motion.status), groups=groups, takes=takes)


def _viewer(
    folder: Path, index: NDArray[np.int64], time_s: Array, status: NDArray[Any], *, groups: list, takes: Sequence[Take]
) -> Viewer:
    rows = slice(None, None, -(-max(len(index), 1) // _MOST_ROWS))
    for group in groups:
        for series in group["series"]:
            series |= {"value": _plain(series["value"][rows]), "sd": _plain(series["sd"][rows])}
    return {
        "frame": index[rows].tolist(),
        "time_s": time_s[rows].round(6).tolist(),
        "status": status[rows].tolist(),
        "groups": groups,
        "film": read_film(folder / VIDEOS / PICTURES),
        "glb": base64.b64encode(animation_bytes(takes)).decode() if takes else None,
    }


def _body_groups(motion: Motion, model: BodyModel) -> Iterator[dict[str, Any]]:
    place = [_series(axis, "m", motion.position[:, k], motion.position_sd[:, k]) for k, axis in enumerate("xyz")]
    yield {"name": "position", "series": place}
    angles = root_angles(motion)
    turns = [_series(name, "°", angles.deg[:, k], angles.sd_deg[:, k]) for k, name in enumerate(ROOT_ANGLES)]
    yield {"name": "somersault, tilt, twist", "series": turns}
    if motion.joints:
        angles_of = joint_angles(motion, model)
        bends: dict[str, list] = {}
        for segment, label, sign in main_joints(motion.joints):
            of_joint = angles_of.sel(joint=segment, axis="x")
            sd = of_joint["angle_sd"].to_numpy()
            value = np.where(np.isinf(sd), np.nan, sign * of_joint["angle"].to_numpy())
            bends.setdefault(label.split()[0], []).append(_series(label, "°", value, sd))
        yield from ({"name": name, "series": series} for name, series in bends.items())


def _player_groups(motion: PlayersMotion) -> Iterator[dict[str, Any]]:
    for k, player in enumerate(motion.players):
        series = []
        for part in ("hip", "knee", "ankle"):
            pair = [motion.joints.index(f"{part}_{side}") for side in ("left", "right")]
            sd = np.sqrt(motion.covariance[:, k, pair, 2, 2].mean(axis=1))
            series.append(_series(f"{part}s", "m", motion.points[:, k, pair, 2].mean(axis=1), sd))
        yield {"name": f"{player}: height", "series": series}


def _series(name: str, unit: str, value: Array, sd: Array) -> dict[str, Any]:
    return {"name": name, "unit": unit, "value": value, "sd": sd}


def _in_3d(index: NDArray[np.int64], make: Any) -> Sequence[Take]:
    """Return the takes; none of a run that is too long, or too short for an animation."""
    if not 2 <= len(index) <= _MOST_IN_3D:
        return []
    try:
        return [take for take in make() if take.has_pose.any()]
    except ResultError:
        return []


def _plain(values: Array) -> list[float | None]:
    return [float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None for value in values.tolist()]
