"""Why a part is off, and who hides it: the plain cases, each by itself."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.reproduction.block.causes import CAUSES, Situation, causes_of
from airborne.reproduction.block.occlusion import hidden_shares, is_hidden
from airborne.reproduction.block.plan import PARTS
from airborne.synthetic import block_scene

LEGS = np.array([[-0.1, 0, 0.9], [0.1, 0, 0.9], [-0.1, 0, 0.5], [0.1, 0, 0.5], [-0.1, 0, 0.1], [0.1, 0, 0.1]])
N = 12


def situation(**changes):
    """A player who moves upward by 30 mm a frame, another one 2 m beside him, nothing hidden."""
    truth = LEGS + np.arange(N)[:, None, None] * [0, 0, 0.03]
    values = {"truth": truth, "others": truth[:, None] + [2.0, 0, 0], "hidden": np.zeros((N, 3, 6))}
    return Situation(**(values | changes))


def by(*metres):
    """A way [m]."""
    return np.array(metres, float)


def named(estimate, what, torso=None):
    """The cause of every part in the last frame; None where it is not off."""
    return [CAUSES[k] if k >= 0 else None for k in causes_of(estimate, what, torso)[-1]]


def test_part_within_a_decimetre_has_no_cause():
    what = situation()
    assert named(what.truth + by(0.05, 0.05, 0), what) == [None] * 6


def test_every_cause_is_found_where_only_it_holds():
    what, aside = situation(), situation().truth + by(0, 0.2, 0)
    assert named(aside, what) == ["none of these"] * 6
    assert named(aside * np.nan, what) == ["no estimate"] * 6
    assert named(aside, what, np.full(N, 0.11)) == ["torso off by 0.10 m"] * 6
    assert named(aside, what, np.full(N, 0.09)) == ["none of these"] * 6
    assert named(what.truth[:, [1, 0, 3, 2, 5, 4]], what) == ["left and right swapped"] * 6
    assert named(what.truth + by(2.0, 0.05, 0), what) == ["on another player's leg"] * 6
    assert named(aside, situation(hidden=np.full((N, 3, 6), 0.6))) == ["hidden in two cameras"] * 6
    late = np.roll(what.truth, 6, axis=0)
    assert named(late, what) == ["behind the motion"] * 6
    assert named(what.truth + by(0.01, 0, 0.15), what) == ["along the limb"] * 6


def test_one_hidden_camera_is_no_cause():
    hidden = np.zeros((N, 3, 6))
    hidden[:, 0] = 1
    what = situation(hidden=hidden)
    assert named(what.truth + by(0, 0.2, 0), what) == ["none of these"] * 6


@pytest.mark.parametrize(
    ("place", "expected"),
    [([0, 5, 0], True), ([0.09, 5, 0], True), ([0.3, 5, 0], False), ([0, 5, 2.6], False), ([0, 15, 0], False)],
)
def test_capsule_hides_what_lies_behind_it(place, expected):
    start, end = (np.array([place + np.array([0, 0, z])])[None] for z in (-1.0, 1.0))
    points = np.array([[[0, 10.0, 0]]])
    assert is_hidden(points, np.zeros(3), start, end, np.array([0.1])).item() is expected


def test_player_who_stands_in_the_way_hides_the_legs_from_that_camera_alone():
    scene = block_scene(1021, n_frames=76)
    mate = next(player for player in scene.players if player.name == "mate1")
    start = np.zeros(1)
    legs, his = (player.poses(start).root_t[0, :2] for player in (scene.blockers[0], mate))
    to_camera = scene.rig["cam1"].centre[:2] - legs
    spot = legs + 1.0 * to_camera / np.linalg.norm(to_camera)
    in_the_way = replace(scene, players=(scene.blockers[0], mate.moved(spot - his)), n_frames=2)
    shares = hidden_shares(in_the_way)[0, 0]
    assert shares.shape == (len(scene.rig), len(PARTS))
    at = scene.rig.names.index("cam1")
    assert shares[at].mean() > 0.5
    assert np.delete(shares, at, axis=0).mean() < 0.1
