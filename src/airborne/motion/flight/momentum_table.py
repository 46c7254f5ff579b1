"""A body in flight: centre of mass, angular momentum and rotation over time, and a summary of the flight."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.constants import GRAVITY_M_S2
from airborne.errors import BodyError
from airborne.motion.angles import root_angles
from airborne.motion.flight.fall import (
    UNKNOWN_SD_M,
    find_wrong_fall,
    fit_fall,
    flight_rows,
    gravity_deviation,
    may_fall,
)
from airborne.motion.flight.momentum import WINDOW, angular_momenta, centre_of_mass, limit_rotation_variance
from airborne.motion.joints import require_body
from airborne.motion.motion import Motion
from airborne.motion.uncertainty import propagate_variances, standard_deviation
from airborne.tracking.self_check.free_flight import WrongFall
from airborne.types import Array, Triple

if TYPE_CHECKING:
    import xarray as xr

_MOST_SD_M_S2 = 2.5  # of a fall's gravity: more tells nothing of whether it is free, as in `flight.fall`
_FEWEST = 12  # frames of a fall, twice the numbers that say how a body turns in it


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSummary:
    """Summary of all frames with a pose; NaN where there are too few, and of the fall where the body does not fall.

    In free flight the angular momentum is constant and the centre of mass follows a parabola of 9.81 m/s2: departures
    from that check the measurement, or show that the body is not in flight.
    """

    n_poses: int
    somersault_rev: float  # of the root, first to last pose
    twist_rev: float
    tilt_range_deg: tuple[float, float]
    angular_momentum_kg_m2_s: Triple  # mean over the frames, world axes, about the centre of mass
    angular_momentum_sd_kg_m2_s: Triple  # stated standard deviation of a frame, median; errors of masses last all run
    angular_momentum_spread_kg_m2_s: Triple  # standard deviation over the frames
    fitted_gravity_m_s2: float  # downward acceleration of the best-fitting parabola of the centre of mass
    fitted_gravity_sd_m_s2: float  # by the distances from it, and by how the centre of mass wanders in the body
    ballistic_rms_mm: float  # of the centre of mass from the best parabola of 9.81 m/s2

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file."""
        return asdict(self)


def has_inertias(model: BodyModel) -> bool:
    """Tell whether every segment of a body has a mass."""
    return all(segment.inertia is not None for segment in model.segments)


def falls_freely(motion: Motion, model: BodyModel, rows: NDArray[np.intp]) -> bool:
    """Tell whether the centre of mass of a body with masses falls freely over rows with poses, 12 or more."""
    if len(rows) < _FEWEST or not has_inertias(model):
        return False
    com = np.array([centre_of_mass(model.with_pose(motion.pose(row)))[0] for row in rows])
    fall = fit_fall(motion.time_s[rows], com, motion.R[rows])
    return fall.is_free and fall.gravity_sd_m_s2 < _MOST_SD_M_S2


def measure_flight(motion: Motion, model: BodyModel, window: int = WINDOW) -> xr.Dataset:
    """Measure a body in flight, frame by frame, with standard deviations to first order.

    - `com` (time, space) [m]: the centre of mass in the world; where the body falls freely and turns, it is moved in
      the root's frame to where it falls best (see `fit_fall`); `com_sd` holds the root's lasting errors, too,
      `com_sd_frame` those of single frames alone
    - `angular_momentum` (time, space) [kg m2/s]: about the centre of mass, world axes; rates are slopes of
      parabolas over `window` frames, never across a lost frame (see `angular_momenta`)
    - `somersault`, `twist` [rev] and `tilt` [deg] of the root, as in `root_angles`

    A rotation that the images do not constrain counts as uniform over the circle. Raises BodyError where a segment has
    no inertia, ResultError for another body's motion.
    """
    import xarray as xr

    com, variance = centres_of_mass(motion, model)
    com_sd = _whole_sd(motion, com, variance)
    momentum, momentum_variance = angular_momenta(motion, model, window)
    somersault, tilt, twist = root_angles(motion).deg.T
    axes, units = ("time", "space"), "kg m2/s"
    variables = {
        "com": (axes, com, {"units": "m", "frame": "world"}),
        "com_sd": (axes, com_sd, {"units": "m", "frame": "world"}),
        "com_sd_frame": (axes, standard_deviation(variance), {"units": "m", "frame": "world"}),
        "angular_momentum": (axes, momentum, {"units": units, "frame": "world", "about": "centre of mass"}),
        "angular_momentum_sd": (axes, standard_deviation(momentum_variance), {"units": units, "frame": "world"}),
        "somersault": ("time", somersault / 360, {"units": "rev"}),
        "twist": ("time", twist / 360, {"units": "rev"}),
        "tilt": ("time", tilt, {"units": "deg"}),
    }
    coordinates = {
        "time": ("time", motion.time_s, {"units": "s"}),
        "frame": ("time", motion.index),
        "space": list("xyz"),
    }
    history = [f"flight: rates are slopes of parabolas over {window} frames"]
    return xr.Dataset(variables, coordinates, {"history": history})


def state_flight(motion: Motion, model: BodyModel) -> tuple[xr.Dataset, WrongFall | None]:
    """Return `measure_flight` with the sds that tables and figures state, and what its fall says against the run.

    A fall that speaks against the calibration or the frame rate widens the sds of the angular momentum.
    """
    table = measure_flight(motion, model)
    wrong = wrong_flight(motion, table)
    return widen_momentum(table, wrong), wrong


def centres_of_mass(motion: Motion, model: BodyModel) -> tuple[Array, Array]:
    """Return `com` of `measure_flight` and its variances of single frames, (n, 3) [m, m2]; raises as that does."""
    require_body(motion, model)
    missing = [segment.name for segment in model.segments if segment.inertia is None]
    if missing:
        raise BodyError(f"body '{model.name}' has no mass for {', '.join(missing[:3])}; give every segment its inertia")
    com, variance = np.full((2, len(motion), 3), np.nan)
    for row in np.flatnonzero(motion.has_pose):
        com[row], jacobian = centre_of_mass(model.with_pose(motion.pose(row)))
        variance[row] = propagate_variances(jacobian, limit_rotation_variance(motion.covariance[row]))
    return _as_it_falls(motion, com, variance)


def state_centres_of_mass(motion: Motion, model: BodyModel) -> tuple[Array, Array]:
    """Return `com` and `com_sd` of `measure_flight`, both (n, 3) [m]; raises as that does."""
    com, variance = centres_of_mass(motion, model)
    return com, _whole_sd(motion, com, variance)


def flight_summary(motion: Motion, table: xr.Dataset) -> FlightSummary:
    """Reduce a flight, as `measure_flight` gives it, to its headline numbers."""
    rows = np.flatnonzero(motion.has_pose)
    momentum, sd = (table[name].to_numpy() for name in ("angular_momentum", "angular_momentum_sd"))
    is_known = np.isfinite(momentum).all(axis=-1)
    momentum, sd = momentum[is_known], sd[is_known & np.isfinite(sd).all(axis=-1)]
    time_s, com, com_sd = motion.time_s[rows], *(table[name].to_numpy()[rows] for name in ("com", "com_sd_frame"))
    has_fall = len(rows) < 2 or may_fall(time_s, com[:, 2], _known_variance(com_sd))
    gravity, gravity_sd, rms = _fit_parabola(time_s, com, motion.R[rows]) if has_fall else (np.nan,) * 3
    tilt = table["tilt"].to_numpy()[rows]
    return FlightSummary(
        n_poses=len(rows),
        somersault_rev=_change(table["somersault"].to_numpy()[rows]),
        twist_rev=_change(table["twist"].to_numpy()[rows]),
        tilt_range_deg=(float(tilt.min()), float(tilt.max())) if len(rows) else (np.nan, np.nan),
        angular_momentum_kg_m2_s=_triple(momentum.mean(axis=0) if len(momentum) else np.full(3, np.nan)),
        angular_momentum_sd_kg_m2_s=_triple(np.median(sd, axis=0) if len(sd) else np.full(3, np.nan)),
        angular_momentum_spread_kg_m2_s=_triple(
            momentum.std(axis=0, ddof=1) if len(momentum) > 1 else np.full(3, np.nan)
        ),
        fitted_gravity_m_s2=gravity,
        fitted_gravity_sd_m_s2=gravity_sd,
        ballistic_rms_mm=1e3 * rms,
    )


def widen_momentum(table: xr.Dataset, wrong: WrongFall | None) -> xr.Dataset:
    """Return a flight with the sds of its angular momentum widened by a wrong fall; without one, as it is.

    The momentum goes with the frame rate, of which the fall's gravity tells the square root, and with the square of
    lengths: the gravity's own share lies between these, and counts as one standard deviation.
    """
    if wrong is None:
        return table
    share = abs(wrong.gravity_m_s2 / GRAVITY_M_S2 - 1)
    momentum, sd = table["angular_momentum"].to_numpy(), table["angular_momentum_sd"]
    return table.assign(angular_momentum_sd=(sd.dims, np.hypot(sd.to_numpy(), share * np.abs(momentum)), sd.attrs))


def wrong_flight(motion: Motion, table: xr.Dataset) -> WrongFall | None:
    """Return what a flight, as `measure_flight` gives it, says against the calibration or the frame rate."""
    rows = np.flatnonzero(motion.has_pose)
    if len(rows) < 2:
        return None
    com, sd = (table[name].to_numpy()[rows] for name in ("com", "com_sd_frame"))
    return find_wrong_fall(motion.time_s[rows], com, motion.R[rows], _known_variance(sd))


def _whole_sd(motion: Motion, com: Array, variance: Array) -> Array:
    """Return the sd (n, 3) [m] of a centre of mass (n, 3) [m]: of single frames, and of the root's lasting errors.

    It moves and turns with the root: by the rotation vector w it moves by w x arm.
    """
    if motion.lasting is None:
        return standard_deviation(variance)
    turned = np.cross(np.eye(3), (com - motion.position)[:, None]).swapaxes(-1, -2)
    jacobian = np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=-1)
    return standard_deviation(variance + np.einsum("nij,njk,nik->ni", jacobian, motion.lasting, jacobian))


def _as_it_falls(motion: Motion, com: Array, variance: Array) -> tuple[Array, Array]:
    """Return the centre of mass and its variances (n, 3), moved to where it falls best; as given without a fall."""
    posed = np.flatnonzero(motion.has_pose)
    height, stated = com[posed, 2], variance[posed, 2]
    stated = np.where(np.isfinite(stated), stated, UNKNOWN_SD_M**2)
    rows = posed[flight_rows(motion.time_s[posed], height, stated)] if len(posed) > 1 else posed[:0]
    if not len(rows):
        return com, variance
    fall = fit_fall(motion.time_s[rows], com[rows], motion.R[rows])
    if not fall.is_free:
        return com, variance
    added = np.einsum("nij,jk,nik->ni", motion.R, fall.offset_covariance, motion.R)
    return com + motion.R @ fall.offset_m, variance + added


def _fit_parabola(time_s: Array, com: Array, R: Array) -> tuple[float, float, float]:
    """Return the best-fitting downward acceleration of a path (n, 3), its sd, and the RMS residual of free fall [m].

    NaN for fewer than four poses.
    """
    if len(time_s) < 4:
        return np.nan, np.nan, np.nan
    fall = fit_fall(time_s, com, R)
    t = time_s - time_s.mean()
    without_gravity = com + [0, 0, 0.5 * GRAVITY_M_S2] * t[:, None] ** 2
    line = np.vander(t, 2)
    residual = without_gravity - line @ np.linalg.lstsq(line, without_gravity, rcond=None)[0]
    return fall.gravity_m_s2, gravity_deviation(fall, time_s), float(np.sqrt(np.mean(np.sum(residual**2, axis=-1))))


def _known_variance(sd: Array) -> Array:
    """Return the variances (n,) [m2] of heights whose sds are the last of (n, 3) [m]; a wide one where unknown."""
    return np.where(np.isfinite(sd[:, 2]), sd[:, 2], UNKNOWN_SD_M) ** 2


def _change(values: Array) -> float:
    return float(values[-1] - values[0]) if len(values) else np.nan


def _triple(values: Array) -> Triple:
    x, y, z = values.tolist()
    return x, y, z
