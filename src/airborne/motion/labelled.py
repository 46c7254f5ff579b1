"""The root, joints, angles and jumps as labelled arrays: time in seconds, joints by name, units in the attributes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from airborne.body import BodyModel
from airborne.motion.angles import ROOT_ANGLES, root_angles
from airborne.motion.isb import isb_angles
from airborne.motion.joints import joint_angles, joint_statuses, landmarks_with_frame_sds
from airborne.motion.jumps.jump import Jump
from airborne.motion.jumps.table import JUMP_COLUMNS, jump_row
from airborne.motion.motion import Motion
from airborne.motion.players import PlayersMotion

_METRES = {"units": "m", "frame": "world"}
_SD = {"units": "m", "of": "root mean square of the three axes"}
# by the end of a name, the longest first; counts begin with n_
_UNITS = {"_m_s": "m/s", "_m": "m", "_s": "s", "_deg": "deg", "_frame": "frames", "_scale": "1"}
_TEXTS = ("status", "standing_source")


def label_root(motion: Motion, history: Sequence[str] = ()) -> xr.Dataset:
    """Label a motion: coordinate `time` [s], units in the attributes, `history` the operations that led to it."""
    time, vector, angle = ("time",), ("time", "space"), ("time", "joint", "space")
    variables = {
        "status": (time, motion.status, {}),
        "score": (time, motion.score, {"units": "grey levels"}),
        "n_views": (time, motion.n_views, {"units": "1"}),
        "doubts": (time, motion.doubts),
        "position": (vector, motion.position, {"units": "m", "frame": "world"}),
        "position_sd": (vector, motion.position_sd, {"units": "m", "frame": "world"}),
        "quaternion": (("time", "component"), motion.quaternion, {"units": "1", "map": "world_from_root"}),
        "rotation_sd": (vector, motion.rotation_sd, {"units": "rad", "frame": "world"}),
        "joint_rotation_sd": (angle, motion.joint_rotation_sd, {"units": "rad", "frame": "segment"}),
        "joint_angle": (angle, motion.joint_angles, {"units": "rad", "order": "x, y, z, body-fixed"}),
    }
    coordinates = {
        "time": (time, motion.time_s, {"units": "s"}),
        "frame": (time, motion.index),
        "space": list("xyz"),
        "component": list("xyzw"),
        "joint": list(motion.joints),
    }
    return xr.Dataset(variables, coordinates, {"history": list(history)})


def label_joints(motion: Motion, model: BodyModel) -> xr.Dataset:
    """Label a body's landmarks: `position` (time, joint, space) [m], `position_sd` (time, joint) [m], `status` (time).

    `position_sd_frame` (time, joint) [m] is that of errors which change from frame to frame; see
    `landmarks_with_frame_sds` for both. `joint_status` (time, joint) is each landmark's own, see `joint_statuses`. NaN
    where lost. Raises ResultError for another body's motion.
    """
    points, sd, sd_frame = landmarks_with_frame_sds(motion, model)
    variables = {
        "position": (("time", "joint", "space"), points, _METRES),
        "position_sd": (("time", "joint"), sd, _SD),
        "position_sd_frame": (("time", "joint"), sd_frame, _SD),
        "status": (("time",), motion.status, {"of": "frame"}),
        "joint_status": (("time", "joint"), joint_statuses(motion, model, sd), {"of": "joint"}),
    }
    coordinates = {
        "time": ("time", motion.time_s, {"units": "s"}),
        "frame": ("time", motion.index),
        "joint": [landmark.name for landmark in model.landmarks],
        "space": list("xyz"),
    }
    return xr.Dataset(variables, coordinates)


def label_players(motion: PlayersMotion) -> xr.Dataset:
    """Label players' joints: as of a body with a dimension `player` after time, and with `covariance` [m2].

    `covariance` (time, player, joint, space, space_2) is that of each joint for itself; `status` (time, player) is the
    worst `joint_status` (time, player, joint) of hips, knees and ankles.
    """
    per_player = ("time", "player")
    variables = {
        "position": ((*per_player, "joint", "space"), motion.points, _METRES),
        "position_sd": ((*per_player, "joint"), motion.sd, _SD),
        "covariance": ((*per_player, "joint", "space", "space_2"), motion.covariance, {"units": "m2"}),
        "status": (per_player, motion.status),
        "joint_status": ((*per_player, "joint"), motion.joint_status),
    }
    coordinates = {
        "time": ("time", motion.time_s, {"units": "s"}),
        "frame": ("time", motion.index),
        "player": list(motion.players),
        "joint": list(motion.joints),
        "space": list("xyz"),
        "space_2": list("xyz"),
    }
    return xr.Dataset(variables, coordinates)


def label_angles(motion: Motion, model: BodyModel) -> xr.Dataset:
    """Label a body's angles [deg]: `somersault`, `tilt`, `twist` (time) of the root, each with `_sd`; and its joints'.

    `angle` and `angle_sd` (time, joint, axis) are those of `joint_angles`; `is_singular` (time) tells where the root's
    are ambiguous, `joint_is_singular` (time, joint) where a joint's are. `isb_angle` and the others are those of
    `isb_angles`. Raises ResultError for another body's motion.
    """
    joints = joint_angles(motion, model).rename(is_singular="joint_is_singular")
    return _label_root_angles(motion).assign(joints.data_vars).assign(isb_angles(motion, model).data_vars)


def _label_root_angles(motion: Motion) -> xr.Dataset:
    angles, columns = root_angles(motion), dict(enumerate(ROOT_ANGLES))
    variables: dict = {name: ("time", angles.deg[:, k], {"units": "deg"}) for k, name in columns.items()}
    variables |= {f"{name}_sd": ("time", angles.sd_deg[:, k], {"units": "deg"}) for k, name in columns.items()}
    variables["is_singular"] = ("time", angles.is_singular)
    coordinates = {"time": ("time", motion.time_s, {"units": "s"}), "frame": ("time", motion.index)}
    return xr.Dataset(variables, coordinates, {"history": ["angles: somersault, tilt, twist, unwrapped"]})


def label_jumps(jumps: Sequence[Jump]) -> xr.Dataset:
    """Label jumps (jump), each a `player` and a `number`: the columns of jumps.csv; NaN where unknown."""
    rows = [jump_row(jump) for jump in jumps]
    variables = {
        name: ("jump", np.array([row[name] for row in rows], str if name in _TEXTS else float), _attributes(name))
        for name in JUMP_COLUMNS
        if name not in ("player", "jump")
    }
    coordinates = {
        "player": ("jump", np.array([jump.player for jump in jumps], str)),
        "number": ("jump", np.array([jump.number for jump in jumps], int)),
    }
    return xr.Dataset(variables, coordinates)


def _attributes(name: str) -> dict[str, str]:
    if name in _TEXTS:
        return {}
    stem = name.removesuffix("_low").removesuffix("_high")
    unit = "1" if stem.startswith("n_") else next((unit for end, unit in _UNITS.items() if stem.endswith(end)), None)
    if unit is None:
        raise ValueError(f"column {name} of jumps.csv ends in no unit; name it with one of {', '.join(_UNITS)}")
    bound = {"_low": "2.5 %", "_high": "97.5 %"}.get(name.removeprefix(stem))
    return {"units": unit} | ({} if bound is None else {"quantile": bound})
