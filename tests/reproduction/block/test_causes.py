"""Why a part is off, and who hides it: the plain cases, each by itself."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.reproduction.block.causes import CAUSES, PlayerTruth, causes_of
from airborne.reproduction.block.occlusion import is_occluded, occlusion_shares
from airborne.reproduction.block.plan import PAPER_PARTS
from airborne.synthetic import block_scene

LEGS = np.array([[-0.1, 0, 0.9], [0.1, 0, 0.9], [-0.1, 0, 0.5], [0.1, 0, 0.5], [-0.1, 0, 0.1], [0.1, 0, 0.1]])
N = 12


def player_truth(**changes):
    """A player who moves upward by 30 mm a frame, another one 2 m beside him, nothing occluded."""
    truth = LEGS + np.arange(N)[:, None, None] * [0, 0, 0.03]
    values = {"truth": truth, "others": truth[:, None] + [2.0, 0, 0], "occluded": np.zeros((N, 3, 6))}
    return PlayerTruth(**(values | changes))


def by(*metres):
    """A displacement [m]."""
    return np.array(metres, float)


def cause_names(estimate, player, torso=None):
    """The cause of every part in the last frame; None where it is right."""
    return [CAUSES[k] if k >= 0 else None for k in causes_of(estimate, player, torso)[-1]]


def test_part_within_a_decimetre_has_no_cause():
    player = player_truth()
    assert cause_names(player.truth + by(0.05, 0.05, 0), player) == [None] * 6


def test_every_cause_is_found_where_only_it_holds():
    player, aside = player_truth(), player_truth().truth + by(0, 0.2, 0)
    assert cause_names(aside, player) == ["none of these"] * 6
    assert cause_names(aside * np.nan, player) == ["no estimate"] * 6
    assert cause_names(aside, player, np.full(N, 0.11)) == ["torso off by 0.10 m"] * 6
    assert cause_names(aside, player, np.full(N, 0.09)) == ["none of these"] * 6
    assert cause_names(player.truth[:, [1, 0, 3, 2, 5, 4]], player) == ["left and right swapped"] * 6
    assert cause_names(player.truth + by(2.0, 0.05, 0), player) == ["on another player's leg"] * 6
    assert cause_names(aside, player_truth(occluded=np.full((N, 3, 6), 0.6))) == ["hidden in two cameras"] * 6
    late = np.roll(player.truth, 6, axis=0)
    assert cause_names(late, player) == ["behind the motion"] * 6
    assert cause_names(player.truth + by(0.01, 0, 0.15), player) == ["along the limb"] * 6


def test_one_occluded_camera_is_no_cause():
    occluded = np.zeros((N, 3, 6))
    occluded[:, 0] = 1
    player = player_truth(occluded=occluded)
    assert cause_names(player.truth + by(0, 0.2, 0), player) == ["none of these"] * 6


@pytest.mark.parametrize(
    ("point", "expected"),
    [([0, 5, 0], True), ([0.09, 5, 0], True), ([0.3, 5, 0], False), ([0, 5, 2.6], False), ([0, 15, 0], False)],
)
def test_capsule_occludes_what_lies_behind_it(point, expected):
    start, end = (np.array([point + np.array([0, 0, z])])[None] for z in (-1.0, 1.0))
    points = np.array([[[0, 10.0, 0]]])
    assert is_occluded(points, np.zeros(3), start=start, end=end, radius=np.array([0.1])).item() is expected


def test_player_in_between_occludes_the_legs_from_that_camera_alone():
    scene = block_scene(1021, n_frames=76)
    mate = next(player for player in scene.players if player.name == "mate1")
    start = np.zeros(1)
    legs, his = (player.poses(start).root_t[0, :2] for player in (scene.blockers[0], mate))
    to_camera = scene.rig["cam1"].centre[:2] - legs
    spot = legs + 1.0 * to_camera / np.linalg.norm(to_camera)
    in_the_way = replace(scene, players=(scene.blockers[0], mate.translate(spot - his)), n_frames=2)
    shares = occlusion_shares(in_the_way)[0, 0]
    assert shares.shape == (len(scene.rig), len(PAPER_PARTS))
    at = scene.rig.names.index("cam1")
    assert shares[at].mean() > 0.5
    assert np.delete(shares, at, axis=0).mean() < 0.1
