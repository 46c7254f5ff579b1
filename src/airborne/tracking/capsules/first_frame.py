"""The first frame: pose and shape of a jumper, fitted to the images from the player's start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from airborne.body.legs import LEG_POINTS, Legs
from airborne.errors import TrialError
from airborne.tracking.capsules.equations import N_CAPSULES, N_LENGTHS, N_POINTS, pose_state
from airborne.tracking.capsules.fit import JumperFit, JumperPrior, evidence_of, fit_jumper
from airborne.tracking.capsules.jumper import JOINTS, N_DOF, PELVIS, SHANK, SHORTS_END, SOCK_END, THIGH, TRUNK, WAIST
from airborne.tracking.capsules.kernel_arguments import Capsules
from airborne.tracking.capsules.surface_colours import SurfaceColours, learn_unoccluded
from airborne.tracking.capsules.views import MapScale, RegionMaps, map_evidence, map_scale, player_regions
from airborne.types import Array
from airborne.video import Frames

STATURE_PER_LEG = 1 / 0.491  # thigh and shank are this share of the stature: 0.245 and 0.246 (Drillis and Contini)
# of a stature of 1 m: waist, (shorts, socks: shares), trunk, pelvis, thigh, shank, foot, sole
_LENGTHS = np.array([0.094, 0.5, 0.35, 0.24, 0.065, 0.245, 0.246, 0.075, 0.035])
_RADII = np.array([0.054, 0.051, 0.048, 0.031, 0.0226, 0.0242, 0.043, 0.027])  # the same of the radii
_LENGTH_SD = np.array([0.06, 0.15, 0.10, 0.05, 0.004, 0.015, 0.015, 0.01, 0.01])  # [m], shares
_RADIUS_SD = 0.10  # of the radius
_POSE_SD = np.array([0.1] * 3 + [0.5] * 5 + [0.5, 0.5, 0.6, 0.5, 0.5] * 2)  # beside the anchors [m, rad]
_ANCHOR_SD_M = np.array([0.02] * 6 + [0.03] * 2 + [0.04])  # of hand-set joints
_IK_WEIGHT = 0.3  # of the feet and the torso, which the legs' lengths do not determine
_CROUCH = np.array([0, 0, 0, 0, 0, 0.2, 0, 0] + [-0.3, 0, 0, 0.5, 0] * 2)  # a slight crouch [rad]
_CROUCH_WEIGHT_M = np.array([0] * 4 + [0.003] * 2 + [0.01] * 2 + [0.003, 0.003, 0.01, 0, 0.01] * 2)  # per rad
_ROUNDS, _MOST_STEPS = 4, 12  # of colours and pose in turn; steps of a pose
_BORDER_SHARES = np.linspace(0.05, 0.95, 19)  # of a segment, where the border of a sock or of the shorts is tried


@dataclass(frozen=True, slots=True, eq=False)
class FirstFrameFit:
    """A player fitted to the first frame."""

    fit: JumperFit
    colours: SurfaceColours
    scale: MapScale


def points_of(state: Array) -> Array:
    """Return the positions of a state's JOINTS: (9, 3) [m]."""
    points, ends, end_radii = np.empty((N_POINTS, 3)), np.empty((N_CAPSULES, 2, 3)), np.empty((N_CAPSULES, 2))
    pose_state(state, points, ends, end_radii, np.empty(N_CAPSULES))
    return points


def average_shape(stature_m: float) -> Array:
    """Return the lengths and radii (17,) of an average person [m]; where shorts and socks end as shares."""
    lengths = _LENGTHS * stature_m
    lengths[SHORTS_END : SOCK_END + 1] = _LENGTHS[SHORTS_END : SOCK_END + 1]
    return np.concatenate([lengths, _RADII * stature_m])


def start_state(name: str, joints_m: Mapping[str, Array]) -> Array:
    """Return the state (35,) nearest to hand-set joints; raises TrialError or BodyError where they are unusable."""
    missing = [joint for joint in ("torso", *LEG_POINTS) if joint not in joints_m]
    if missing:
        raise TrialError(f"player '{name}' has no {', '.join(missing)} in [start]; give torso, hips, knees and ankles")
    legs = Legs.from_points(joints_m["torso"], np.array([joints_m[joint] for joint in LEG_POINTS]))
    stature_m = (legs.thigh_m + legs.shank_m) * STATURE_PER_LEG
    state = np.concatenate([np.zeros(N_DOF), average_shape(stature_m)])
    lengths = state[N_DOF : N_DOF + N_LENGTHS]
    lengths[[PELVIS, THIGH, SHANK]] = legs.half_pelvis_m, legs.thigh_m, legs.shank_m
    lengths[TRUNK] = 2 * legs.torso_to_hips_m - lengths[WAIST]
    hips = (np.asarray(joints_m["hip_left"]) + joints_m["hip_right"]) / 2
    across = np.asarray(joints_m["hip_left"]) - joints_m["hip_right"]
    state[:N_DOF] = _CROUCH
    state[:3], state[3] = hips, np.arctan2(across[1], across[0])
    used = [i for i, joint in enumerate(JOINTS) if joint in joints_m]
    targets = np.array([joints_m[JOINTS[i]] for i in used])
    weights = np.array([1.0 if JOINTS[i] in LEG_POINTS else _IK_WEIGHT for i in used])
    rest = state[:N_DOF].copy()

    def residuals(pose: Array) -> Array:
        points = points_of(np.concatenate([pose, state[N_DOF:]]))[used]
        return np.concatenate([((points - targets) * weights[:, None]).ravel(), _CROUCH_WEIGHT_M * (pose - rest)])

    state[:N_DOF] = least_squares(residuals, rest).x
    return state


def fit_first_frame(
    name: str,
    joints_m: Mapping[str, Array],
    frames: Frames,
    others: Capsules,
    *,
    looser: float = 1.0,
    freer: float = 1.0,
    start: Array | None = None,
) -> FirstFrameFit:
    """Fit pose and shape to the first frame, with the colours relearned in each round.

    Joints that were not set by hand are `looser` by a factor, and lengths of legs `freer`. `start` (35,) is their
    `start_state`, where it is known.

    Raises TrialError where no camera shows the player.
    """
    state = start_state(name, joints_m) if start is None else start
    anchors = np.array([joints_m.get(joint, np.full(3, np.nan)) for joint in JOINTS], float)
    sd = np.concatenate([_POSE_SD, _LENGTH_SD, _RADIUS_SD * state[N_DOF + N_LENGTHS :]])
    sd[[N_DOF + THIGH, N_DOF + SHANK]] *= freer
    prior = JumperPrior(state.copy(), np.diag(1 / sd**2), anchors, looser * _ANCHOR_SD_M)
    borders = [N_DOF + SHORTS_END, N_DOF + SOCK_END]
    for number in range(_ROUNDS):
        regions = player_regions(frames, state[:3])
        if not regions:
            raise TrialError(f"player '{name}' is in no camera's image at the start; check its joints_m, in metres")
        colours = learn_unoccluded(state, regions, len(frames.views), others)
        scale = map_scale(regions, state[:3])
        region_maps = map_evidence(regions, [colours.table(region.view) for region in regions], scale)
        if number < 2:
            state = _search_borders(state, region_maps, others)
            mean = prior.mean.copy()
            mean[borders] = state[borders]
            prior = replace(prior, mean=mean)
        fitted = fit_jumper(state, prior, region_maps, others, most_steps=_MOST_STEPS)
        state = fitted.state
    return FirstFrameFit(fitted, colours, scale)


def _search_borders(state: Array, region_maps: RegionMaps, others: Capsules) -> Array:
    """Search where shorts and socks end, on a grid."""
    for border in (SHORTS_END, SOCK_END):
        candidates = []
        for share in _BORDER_SHARES:
            state = state.copy()
            state[N_DOF + border] = share
            candidates.append((evidence_of(state, region_maps, others), state))
        state = max(candidates, key=lambda each: each[0])[1]
    return state
