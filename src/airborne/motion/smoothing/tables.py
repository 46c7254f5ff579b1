"""The tables of a smooth motion: smooth_motion.csv, smooth_joints.csv, smooth_joint_angles.csv, smooth_events.csv."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from airborne.io.writing import write_text
from airborne.motion.angles import ROOT_ANGLES
from airborne.motion.flight.phases import Event
from airborne.motion.smoothing import parabolic_peak
from airborne.motion.tables import cell

_Columns = dict[str, NDArray]

_POSITION = {"position": "{}_m", "velocity": "v{}_m_s", "acceleration": "a{}_m_s2"}
_JOINT_SD = {"position": "sd_m", "velocity": "v_sd_m_s", "acceleration": "a_sd_m_s2"}


def write_smooth_motion(path: Path, table: xr.Dataset) -> None:
    """Write the result of `smooth_root`, one row per frame: position, orientation, derivatives; degrees."""
    columns = _index_columns(table) | {"status": table["status"].to_numpy()}
    for name, stem in _POSITION.items():
        columns |= {stem.format(axis): _component(table, name, axis) for axis in "xyz"}
        columns |= {f"{stem.format(axis)}_sd": _component(table, f"{name}_sd", axis) for axis in "xyz"}
    columns |= {f"q{one}": table["quaternion"].sel(component=one).to_numpy() for one in "xyzw"}
    columns |= {"rotation_deg_sd": np.rad2deg(table["rotation_sd"].to_numpy())}
    columns |= {f"{name}_deg": table[name].to_numpy() for name in ROOT_ANGLES}
    columns |= {"is_singular": table["is_singular"].to_numpy().astype(int)}
    for name, stem in (("angular_velocity", "w{}_rad_s"), ("angular_acceleration", "alpha{}_rad_s2")):
        columns |= {stem.format(axis): _component(table, name, axis) for axis in "xyz"}
        columns |= {f"{stem.format('')}_sd": table[f"{name}_sd"].to_numpy()}
    _write(path, columns)


def write_smooth_joints(path: Path, table: xr.Dataset) -> None:
    """Write the result of `smooth_landmarks` or `smooth_players`, one row per frame (and player) and joint.

    Standard deviations are the root mean square over the axes; `status` is that of what was tracked.
    """
    columns = _index_columns(table) | {"status": table["joint_status"].to_numpy().ravel()}
    for name, stem in _POSITION.items():
        columns |= {stem.format(axis): _component(table, name, axis) for axis in "xyz"}
    for name, column in _JOINT_SD.items():
        columns[column] = np.sqrt(np.mean(table[f"{name}_sd"].to_numpy() ** 2, axis=-1)).ravel()
    _write(path, columns)


def write_smooth_joint_angles(path: Path, table: xr.Dataset) -> None:
    """Write the result of `smooth_joint_angles`, one row per frame and joint; degrees and degrees per second."""
    columns = _index_columns(table)
    columns |= {f"{axis}_deg": table["angle"].sel(axis=axis).to_numpy().ravel() for axis in "xyz"}
    columns |= {f"w{axis}_deg_s": table["velocity"].sel(axis=axis).to_numpy().ravel() for axis in "xyz"}
    columns |= {
        "sd_deg": table["rotation_sd"].to_numpy().ravel(),
        "w_sd_deg_s": table["velocity_sd"].to_numpy().ravel(),
    }
    _write(path, columns | {"is_singular": table["is_singular"].to_numpy().astype(int).ravel()})


def write_smooth_events(path: Path, events: Mapping[str, Sequence[Event]], joints: xr.Dataset) -> None:
    """Write take-offs and landings of each player ("" for a body), and each joint's peak between them.

    Heights are those of `joints`; a segment whose highest frame is its first or last has no peak.
    """
    rows = [(player, "", event.name, event.time_s, np.nan) for player in events for event in events[player]]
    players = joints["player"].to_numpy().tolist() if "player" in joints.dims else [""]
    time_s = joints["time"].to_numpy()
    for player in players:
        own = joints.sel(player=player) if player else joints
        for joint in own["joint"].to_numpy().tolist():
            height = own["position"].sel(joint=joint, space="z").to_numpy()
            segment = own["segment"].sel(joint=joint).to_numpy()
            for number in range(int(segment.max()) + 1):
                inside = np.flatnonzero((segment == number) & np.isfinite(height))
                if len(inside) and inside[0] < inside[np.argmax(height[inside])] < inside[-1]:
                    rows.append((player, joint, "highest", *parabolic_peak(time_s[inside], height[inside])))
    rows.sort(key=lambda row: (row[0], row[1], row[3]))
    names = ("player", "joint", "event", "time_s", "z_m")
    lines = [",".join(names), *(",".join(cell(value) for value in row) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")


def _index_columns(table: xr.Dataset) -> _Columns:
    """Return the index columns of a table with one row per time (and player) and joint."""
    axes = [name for name in ("time", "player", "joint") if name in table.dims]
    shape = tuple(table.sizes[name] for name in axes)
    grid = np.indices(shape).reshape(len(shape), -1)
    columns: _Columns = {}
    if "player" in axes:
        columns["player"] = table["player"].to_numpy()[grid[axes.index("player")]]
    columns |= {"frame": table["frame"].to_numpy()[grid[0]], "time_s": table["time"].to_numpy()[grid[0]]}
    if "joint" in axes:
        columns["joint"] = table["joint"].to_numpy()[grid[-1]]
    flags = [name for name in ("segment", "is_filled") if name in table]
    return columns | {name: table[name].to_numpy().astype(int).ravel() for name in flags}


def _component(table: xr.Dataset, name: str, axis: str) -> NDArray:
    return table[name].sel(space=axis).to_numpy().ravel()


def _write(path: Path, columns: _Columns) -> None:
    lines = [",".join(columns)]
    lines += [",".join(map(cell, row)) for row in zip(*(column.tolist() for column in columns.values()), strict=True)]
    write_text(path, "\n".join(lines) + "\n")
