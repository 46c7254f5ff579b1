"""The tables of a run: motion.parquet, angles.csv, joints.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import xarray as xr
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.geometry.rotations import (
    angles_from_matrix,
    angles_from_world_rotation,
    is_near_singular,
    unwrapped,
)
from airborne.motion.motion import Motion

Array = NDArray[np.floating]

_ANGLES = ("somersault", "tilt", "twist")
_UNITS = {"_m": "m", "_s": "s", "_deg": "deg", "_m_sd": "m", "_deg_sd": "deg"}


def motion_columns(motion: Motion) -> dict[str, NDArray]:
    """Lay a motion out as the columns of motion.csv and motion.parquet, each (n,); the unit is in the name."""
    columns: dict[str, NDArray] = {
        "frame": motion.index,
        "time_s": motion.time_s,
        "status": motion.status,
        "score": motion.score,
    }
    columns |= {f"{axis}_m": motion.position[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"q{axis}": motion.quaternion[:, k] for k, axis in enumerate("xyzw")}
    columns |= {f"{axis}_m_sd": motion.position_sd[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"r{axis}_deg_sd": np.rad2deg(motion.rotation_sd[:, k]) for k, axis in enumerate("xyz")}
    return columns | {"n_views": motion.n_views}


def write_motion_parquet(path: Path, motion: Motion) -> None:
    """Write the columns of motion.csv, and joint angles in degrees, with their units in the metadata."""
    columns = motion_columns(motion)
    for k, joint in enumerate(motion.joints):
        columns |= {f"{joint}_{axis}_deg": np.rad2deg(motion.joint_angles[:, k, i]) for i, axis in enumerate("xyz")}
    arrays = [pa.array(column, from_pandas=True) for column in columns.values()]  # NaN becomes null
    fields = [
        pa.field(name, array.type, metadata={"units": _unit(name)}) for name, array in zip(columns, arrays, strict=True)
    ]
    conventions = {"world": "metres, z up", "quaternion": "x, y, z, w; world from root", "rotation_sd": "world axes"}
    pq.write_table(pa.table(arrays, schema=pa.schema(fields, metadata=conventions)), path)


def angles(motion: Motion) -> xr.Dataset:
    """Read somersault, tilt and twist [deg] off a motion, unwrapped over time, with standard deviations.

    The deviations follow from the rotation's covariance to first order; NaN where that is unknown or infinite, and
    near +-90 degrees of tilt, where `is_singular` says that somersault and twist cannot be told apart.
    """
    radians = unwrapped(angles_from_matrix(motion.R), motion.time_s)
    jacobian = angles_from_world_rotation(radians)
    covariance = motion.covariance[:, 3:, 3:]
    is_known = np.isfinite(covariance).all(axis=(-2, -1), keepdims=True)
    variance = np.einsum("nij,njk,nik->ni", jacobian, np.where(is_known, covariance, np.nan), jacobian)
    sd = np.sqrt(np.where(variance >= 0, variance, np.nan))
    variables: dict = {name: ("time", np.rad2deg(radians[:, k]), {"units": "deg"}) for k, name in enumerate(_ANGLES)}
    variables |= {f"{name}_sd": ("time", np.rad2deg(sd[:, k]), {"units": "deg"}) for k, name in enumerate(_ANGLES)}
    variables["is_singular"] = ("time", is_near_singular(radians))
    coordinates = {"time": ("time", motion.time_s, {"units": "s"}), "frame": ("time", motion.index)}
    return xr.Dataset(variables, coordinates, {"history": ["angles: somersault, tilt, twist, unwrapped"]})


def write_angles(path: Path, motion: Motion) -> None:
    """Write angles.csv: frame, time_s, the three angles and their deviations in degrees, is_singular (0 or 1)."""
    table = angles(motion)
    columns: dict[str, NDArray] = {"frame": motion.index, "time_s": motion.time_s}
    columns |= {f"{name}_deg": table[name].to_numpy() for name in _ANGLES}
    columns |= {f"{name}_deg_sd": table[f"{name}_sd"].to_numpy() for name in _ANGLES}
    _write_csv(path, columns | {"is_singular": table["is_singular"].to_numpy().astype(int)})


def write_joints(path: Path, motion: Motion, model: BodyModel) -> None:
    """Write joints.csv, long: one row per frame and landmark; empty cells where lost.

    `sd_m` is the root mean square, over the three axes, of the standard deviations that the root's uncertainty gives
    to that point; joint angles count as exact.
    """
    names = [landmark.name for landmark in model.landmarks]
    points = np.full((len(motion), len(names), 3), np.nan)
    for row in np.flatnonzero(motion.has_pose):
        points[row] = model.with_pose(motion.pose(row)).landmarks
    sd = _point_sd(motion.covariance[:, None], points - motion.position[:, None])
    per_frame, flat = len(names), points.reshape(-1, 3)
    columns: dict[str, NDArray] = {
        "frame": np.repeat(motion.index, per_frame),
        "time_s": np.repeat(motion.time_s, per_frame),
        "joint": np.tile(np.array(names), len(motion)),
    }
    columns |= {f"{axis}_m": flat[:, k] for k, axis in enumerate("xyz")}
    _write_csv(path, columns | {"sd_m": sd.ravel()})


def cell(value: object) -> str:
    """Write one value so that a float is read back to the last bit; NaN, the unknown, is an empty cell."""
    if isinstance(value, float):
        return "" if np.isnan(value) else repr(float(value))
    return str(value)


def _point_sd(covariance: Array, offset: Array) -> Array:
    """Per-axis standard deviation (...) of points at `offset` (..., 3) from the root, covariance (..., 6, 6)."""
    x, y, z = np.moveaxis(offset, -1, 0)
    zero = np.zeros_like(x)
    turned = np.stack([np.stack(r, -1) for r in ([zero, z, -y], [-z, zero, x], [y, -x, zero])], -2)
    jacobian = np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=-1)
    moved = jacobian[..., :, :, None] * jacobian[..., :, None, :]
    with np.errstate(invalid="ignore"):  # an infinite variance counts only where the point moves with it
        terms = np.where(moved == 0, 0.0, moved * covariance[..., None, :, :])
        return np.sqrt(terms.sum(axis=(-3, -2, -1)) / 3)


def _unit(name: str) -> str:
    suffix = max((s for s in _UNITS if name.endswith(s)), key=len, default="")
    return "grey levels" if name == "score" else _UNITS.get(suffix, "1")


def _write_csv(path: Path, columns: dict[str, NDArray]) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(cell, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
