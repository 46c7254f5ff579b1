"""The tables of a run: motion.parquet, angles.csv, joints.csv, joint_angles.csv, flight.csv."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.io.parquet import CAN_WRITE_PARQUET, write_parquet
from airborne.io.writing import write_text
from airborne.motion.angles import ROOT_ANGLES, root_angles
from airborne.motion.isb import isb_angles
from airborne.motion.joints import joint_angles, joint_statuses, landmarks_with_frame_sds
from airborne.motion.motion import Motion
from airborne.types import Array

if TYPE_CHECKING:
    import xarray as xr

_UNITS = {"_m": "m", "_s": "s", "_deg": "deg", "_m_sd": "m", "_deg_sd": "deg"}


def motion_columns(motion: Motion) -> dict[str, NDArray]:
    """Return a motion as the columns of motion.csv and motion.parquet, each (n,); units are in the names."""
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
    joints = np.array(motion.joints)
    uncertain = ["/".join(joints[is_uncertain]) for is_uncertain in motion.uncertain_joints]
    columns |= {"n_views": motion.n_views, "doubts": motion.doubts}
    return columns | {"uncertain_joints": np.array(uncertain, np.str_)}


def write_motion_parquet(path: Path, motion: Motion) -> None:
    """Write the columns of motion.csv, and joints as angles in degrees and as quaternions, units in the metadata.

    Without *pyarrow* nothing is written.
    """
    if not CAN_WRITE_PARQUET:
        return
    columns = motion_columns(motion)
    for k, joint in enumerate(motion.joints):
        columns |= {f"{joint}_{axis}_deg": np.rad2deg(motion.joint_angles[:, k, i]) for i, axis in enumerate("xyz")}
        quaternion = motion.joint_quaternion[:, k]
        columns |= {f"{joint}_q{axis}": quaternion[:, i] for i, axis in enumerate("xyzw")}
    conventions = {
        "world": "metres, z up",
        "quaternion": "x, y, z, w; world from root, and parent from segment",
        "rotation_sd": "world axes",
    }
    write_parquet(path, columns, {name: _unit(name) for name in columns}, conventions)


def write_uncertainty(path: Path, motion: Motion, constant: Array) -> None:
    """Write uncertainty.csv: the root's sds, split into errors that last all run long and those of each frame.

    constant (n, 6, 6): covariance of the lasting ones [m, rad].
    """
    total = np.hstack([motion.position_sd, motion.rotation_sd])
    lasting = np.fmin(np.sqrt(np.diagonal(constant, axis1=1, axis2=2)), total)  # frames hold some of it
    own = np.sqrt(np.diagonal(motion.covariance, axis1=1, axis2=2))[:, :6]
    by_frame = np.sqrt(np.maximum(total**2 - lasting**2, own**2 / 4))  # own sds hold some that lasts
    columns: dict[str, NDArray] = {"frame": motion.index, "time_s": motion.time_s}
    for name, sd in (("sd_constant", np.where(np.isnan(total), np.nan, lasting)), ("sd_frame", by_frame)):
        columns |= {f"{axis}_m_{name}": sd[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"r{axis}_deg_{name}": np.rad2deg(sd[:, 3 + k]) for k, axis in enumerate("xyz")}
    _write_csv(path, columns)


def write_angles(path: Path, motion: Motion) -> None:
    """Write angles.csv: frame, time_s, the three angles and their sd in degrees, is_singular (0 or 1)."""
    angles = root_angles(motion)
    columns: dict[str, NDArray] = {"frame": motion.index, "time_s": motion.time_s}
    columns |= {f"{name}_deg": angles.deg[:, k] for k, name in enumerate(ROOT_ANGLES)}
    columns |= {f"{name}_deg_sd": angles.sd_deg[:, k] for k, name in enumerate(ROOT_ANGLES)}
    _write_csv(path, columns | {"is_singular": angles.is_singular.astype(int)})


def write_joints(path: Path, motion: Motion, model: BodyModel) -> NDArray[np.str_]:
    """Write joints.csv, long: one row per frame and landmark; empty cells where lost. Return each one's status.

    `sd_m` is the root mean square, over the three axes, of the point's standard deviations, propagated from the
    covariance through every joint that moves it; infinite where a direction that moves it is unobserved. `sd_frame_m`
    is that of errors which change from frame to frame, see `landmarks_with_frame_sds`. `status` is the joint's own, (n,
    landmarks): see `joint_statuses`.
    """
    points, sd, sd_frame = landmarks_with_frame_sds(motion, model)
    status = joint_statuses(motion, model, sd)
    names = np.array([landmark.name for landmark in model.landmarks])
    columns = _long(motion, names) | {f"{axis}_m": points[..., k].ravel() for k, axis in enumerate("xyz")}
    _write_csv(path, columns | {"sd_m": sd.ravel(), "sd_frame_m": sd_frame.ravel(), "status": status.ravel()})
    return status


def write_joint_angles(path: Path, motion: Motion, model: BodyModel) -> None:
    """Write joint_angles.csv, long: a row per frame and joint, named by its segment; degrees, in x-y-z and ISB's way.

    Raises ResultError for another body's motion.
    """
    table = joint_angles(motion, model)
    columns = _long(motion, np.array(motion.joints, np.str_))
    columns |= {f"{axis}_deg": table["angle"].sel(axis=axis).to_numpy().ravel() for axis in "xyz"}
    for sd in ("sd", "sd_frame"):
        columns |= {f"{axis}_deg_{sd}": table[f"angle_{sd}"].sel(axis=axis).to_numpy().ravel() for axis in "xyz"}
    columns["is_singular"] = table["is_singular"].to_numpy().astype(int).ravel()
    isb = isb_angles(motion, model)
    columns["isb_sequence"] = np.tile(isb["isb_sequence"].to_numpy(), len(motion))
    columns |= {f"isb_{k}_deg": isb["isb_angle"].sel(rotation=k).to_numpy().ravel() for k in (1, 2, 3)}
    for sd in ("sd", "sd_frame"):
        columns |= {f"isb_{k}_deg_{sd}": isb[f"isb_angle_{sd}"].sel(rotation=k).to_numpy().ravel() for k in (1, 2, 3)}
    _write_csv(path, columns | {"isb_is_singular": isb["isb_is_singular"].to_numpy().astype(int).ravel()})


def write_flight(path: Path, motion: Motion, table: xr.Dataset) -> None:
    """Write flight.csv: the centre of mass, the angular momentum about it, the root's rotation, units in the names.

    The table is that of `state_flight`; each frame's status is its pose's.
    """
    columns: dict[str, NDArray] = {"frame": motion.index, "time_s": motion.time_s, "status": motion.status}
    for name, stem in (("com", "com_{}_m"), ("angular_momentum", "L_{}_kg_m2_s")):
        columns |= {stem.format(axis): table[name].sel(space=axis).to_numpy() for axis in "xyz"}
        for sd in ("sd", "sd_frame"):
            of_axes = table.get(f"{name}_{sd}")
            if of_axes is not None:
                columns |= {f"{stem.format(axis)}_{sd}": of_axes.sel(space=axis).to_numpy() for axis in "xyz"}
    columns |= {"somersault_rev": table["somersault"].to_numpy(), "twist_rev": table["twist"].to_numpy()}
    _write_csv(path, columns | {"tilt_deg": table["tilt"].to_numpy()})


def cell(value: object) -> str:
    """Format one value so that a float reads back bit for bit; NaN (unknown) is an empty cell."""
    if isinstance(value, float):
        return "" if value != value else float.__repr__(value)  # faster than isnan, and np.float64 has another repr
    return str(value)


def _long(motion: Motion, names: NDArray[np.str_]) -> dict[str, NDArray]:
    """Return the index columns of a table with one row per frame and joint."""
    return {
        "frame": np.repeat(motion.index, len(names)),
        "time_s": np.repeat(motion.time_s, len(names)),
        "joint": np.tile(names, len(motion)),
    }


def _unit(name: str) -> str:
    suffix = max((s for s in _UNITS if name.endswith(s)), key=len, default="")
    return "grey levels" if name == "score" else _UNITS.get(suffix, "1")


def _write_csv(path: Path, columns: dict[str, NDArray]) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(cell, row)) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")
