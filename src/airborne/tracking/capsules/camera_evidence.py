"""What each camera alone says of a player whom all cameras track, by which a camera whose clock is off is found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airborne.tracking.camera_lags import LagEquations
from airborne.tracking.capsules.bystanders import occluding_capsules
from airborne.tracking.capsules.dynamics import N_FREE
from airborne.tracking.capsules.fit import POSTURE_INFORMATION, view_equations
from airborne.tracking.capsules.jumper import N_DOF
from airborne.tracking.capsules.track import Everybody
from airborne.tracking.capsules.views import map_evidence, player_regions
from airborne.tracking.time_offsets import compensate_at_velocity
from airborne.types import Array
from airborne.video import Frames

# chosen on synthetic blocks 9001 to 9032: errors of the capsules' outlines, which stay for a stride, are so long alike
_CORRELATED_S = 1 / 6
WEAK_SD = 0.3  # [m, rad, shares], chosen: of a prior that keeps what no camera shows where it is
_PRIOR = np.eye(N_FREE) / WEAK_SD**2
_PRIOR[:N_DOF, :N_DOF] += POSTURE_INFORMATION


class LagMoment(NamedTuple):
    """One player at one time, by each of c cameras: equations of the pose and the sliding lengths, n numbers."""

    time_s: float
    velocity: Array  # (n,) [m/s, rad/s], zero of the sliding lengths
    information: Array  # (c, n, n); zero of a camera that does not show the player
    gradient: Array  # (c, n)


def moment_of(everybody: Everybody, player: str, frames: Frames) -> LagMoment:
    """Return what each camera's image says of a player, about the state after the frames' step."""
    track = everybody.players[player]
    tracks = (*everybody.players.values(), *everybody.bystanders)
    others = [each.state for each in tracks if each is not track and each.lost_s is None]
    compensated = compensate_at_velocity(frames, track.filtered.hips_velocity_m_s)
    regions, n = player_regions(compensated, track.state[:3]), len(frames.views)
    information, gradient = np.zeros((n, N_FREE, N_FREE)), np.zeros((n, N_FREE))
    if regions:
        views = [region.view for region in regions]
        maps = map_evidence(regions, [track.tables[view] for view in views], track.scale)
        occluders = occluding_capsules(track.state, others)
        information[views], gradient[views] = view_equations(track.state, maps, occluders, N_FREE)
    velocity = np.concatenate([track.filtered.mean[N_FREE:], np.zeros(N_FREE - N_DOF)])
    return LagMoment(float(frames.time_s), velocity, information, gradient)


def lag_equations(moments: Sequence[LagMoment]) -> LagEquations:
    """Stack moments, those of one player after those of another, each in the order of time."""
    time_s = np.array([each.time_s for each in moments])
    step_s = np.diff(time_s)
    return LagEquations(
        time_s,
        np.stack([each.velocity for each in moments]),
        np.stack([each.information for each in moments]),
        np.stack([each.gradient for each in moments]),
        prior=_PRIOR,
        n_correlated=max(1, round(_CORRELATED_S / float(np.median(step_s[step_s > 0])))),
        is_noise_known=True,  # the scatter of so few strides alone states sds that are a third too small
    )
