"""The truth of a block scene, and simulated inputs: hand-set starts and tracked torsos."""

from __future__ import annotations

import numpy as np

from airborne.constants import GRAVITY_M_S2
from airborne.synthetic.block.players import Player
from airborne.synthetic.block.scene import BlockScene
from airborne.types import Array

TRUTH_JOINTS = {  # column of the truth, landmark
    f"{side[0]}_{joint}": f"{joint}_{side}"
    for joint in ("hip", "knee", "ankle", "foot", "toe", "shoulder")
    for side in ("left", "right")
} | {"head": "head"}
_START_JOINTS = tuple(f"{joint}_{side}" for joint in ("hip", "knee", "ankle", "foot") for side in ("left", "right"))
_TORSO_OF = ("hip_left", "hip_right", "shoulder_left", "shoulder_right")
_CORRELATION = 0.8  # of the torso's error from frame to frame
_FINE_HZ = 2000.0  # at which the peaks of the true paths are sought


def true_joints(player: Player, time_s: Array) -> dict[str, Array]:
    """Return a player's true joints at the scene's times (n,) [s]: (n, 3) world [m] each.

    Names as `hip_left`; `foot_left` is the ball, `toe_left` the tip, `head` the head's middle, and `torso` the mean of
    hips and shoulders.
    """
    marks = player.movement.person.landmarks(player.poses(time_s))
    joints = {name: marks[name] for name in TRUTH_JOINTS.values()}
    return joints | {"torso": np.mean([marks[name] for name in _TORSO_OF], axis=0)}


def noisy_starts(scene: BlockScene) -> dict[str, dict[str, Array]]:
    """Return the joints as set by hand in the first frame: player -> joint -> (3,) [m], blockers first.

    Blockers have their torso, hips, knees, ankles and feet, the others their torso only; each coordinate is off by a
    normal deviate of sd `start_noise_m`.
    """
    rng = np.random.default_rng([scene.seed, 24])
    starts = {}
    for player in scene.players:
        true = true_joints(player, np.zeros(1))
        names = ("torso", *_START_JOINTS) if player.role == "blocker" else ("torso",)
        starts[player.name] = {name: true[name][0] + rng.normal(0, scene.difficulty.start_noise_m, 3) for name in names}
    return starts


def torso_input(scene: BlockScene) -> Array:
    """Return all players' torsos as from a torso tracker: (frames, players, 3) [m].

    The truth with an error of sd `torso_noise_m` for each coordinate, correlated by 0.8 from frame to frame.
    """
    rng = np.random.default_rng([scene.seed, 25])
    true = np.stack([true_joints(player, scene.times_s)["torso"] for player in scene.players], axis=1)
    error = rng.normal(0, scene.difficulty.torso_noise_m, true.shape)
    for k in range(1, len(error)):
        error[k] = _CORRELATION * error[k - 1] + np.sqrt(1 - _CORRELATION**2) * error[k]
    return true + error


def jump_truth(player: Player, rate_hz: float) -> dict[str, float]:
    """Return the truth of a player's jump; frames are fractions, counted from the recording's first [frame].

    Rises of hips and feet (ankles) are from the upright stand on level soles to the peak.
    """
    flight = player.movement.flight
    assert flight is not None and player.takeoff_s is not None and player.touch_s is not None, "a jumper"
    leg = player.movement.person.leg
    sole = leg.foot_half_height_m - leg.foot_centre_m[2]
    hips_standing = leg.thigh_m + leg.shank_m + sole
    joints = true_joints(player, np.linspace(player.takeoff_s, player.touch_s, round(flight.duration_s * _FINE_HZ)))
    hips = (joints["hip_left"] + joints["hip_right"])[:, 2] / 2
    ankles = (joints["ankle_left"] + joints["ankle_right"])[:, 2] / 2
    rise_s = float(flight.velocity[2]) / GRAVITY_M_S2
    return {
        "last_contact_frame": player.takeoff_s * rate_hz,
        "first_contact_frame": player.touch_s * rate_hz,
        "apex_frame": (player.takeoff_s + rise_s) * rate_hz,
        "last_contact_s": player.takeoff_s,
        "first_contact_s": player.touch_s,
        "flight_s": flight.duration_s,
        "takeoff_speed_m_s": float(flight.velocity[2]),
        "com_rise_from_takeoff_m": float(flight.velocity[2] ** 2 / (2 * GRAVITY_M_S2)),
        "com_acceleration": -GRAVITY_M_S2,
        "hip_apex_m": float(hips.max()),
        "hip_rise_from_takeoff_m": float(hips.max() - hips[0]),
        "hip_rise_over_standing_m": float(hips.max() - hips_standing),
        "ankle_apex_m": float(ankles.max()),
        "foot_rise_m": float(ankles.max() - sole),
    }
