"""Legs are measured from the joints of one frame."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body.legs import LEG_POINTS, RODS, Legs
from airborne.errors import BodyError
from tests.support.tolerances import EXACT

TORSO = np.array([0.1, 0.2, 1.25])
POINTS = np.array(
    [[0.22, 0.2, 0.95], [-0.02, 0.2, 0.95], [0.25, 0.1, 0.53], [-0.05, 0.12, 0.52], [0.28, 0.2, 0.1], [-0.1, 0.2, 0.11]]
)


def test_lengths_are_the_distances_and_the_means_of_both_sides():
    legs = Legs.from_points(TORSO, POINTS)
    thighs = np.linalg.norm(POINTS[[0, 1]] - POINTS[[2, 3]], axis=1)
    shanks = np.linalg.norm(POINTS[[2, 3]] - POINTS[[4, 5]], axis=1)
    assert legs.half_pelvis_m == pytest.approx(0.12, abs=EXACT)
    assert legs.torso_to_hips_m == pytest.approx(0.30, abs=EXACT)
    assert legs.thigh_m == pytest.approx(thighs.mean(), abs=EXACT)
    assert legs.shank_m == pytest.approx(shanks.mean(), abs=EXACT)
    assert legs.knee_gap_m == pytest.approx(np.hypot(0.3, np.hypot(0.02, 0.01)), abs=EXACT)
    assert legs.foot_gap_m == pytest.approx(np.hypot(0.38, 0.01), abs=EXACT)


def test_rods_join_hip_knee_and_ankle_of_one_side():
    for a, b in RODS:
        assert LEG_POINTS[a].rpartition("_")[2] == LEG_POINTS[b].rpartition("_")[2]
    assert {(LEG_POINTS[a].split("_")[0], LEG_POINTS[b].split("_")[0]) for a, b in RODS} == {
        ("hip", "knee"),
        ("knee", "ankle"),
    }


def test_legs_are_the_same_wherever_the_player_stands():
    turn = Rotation.from_euler("xyz", [0.4, -1.0, 2.0])
    legs = Legs.from_points(TORSO, POINTS)
    moved = Legs.from_points(turn.apply(TORSO) + 3, turn.apply(POINTS) + 3)
    for name in Legs.__dataclass_fields__:
        assert getattr(moved, name) == pytest.approx(getattr(legs, name), abs=1e-12)


def test_legs_are_the_same_for_the_mirrored_player():
    mirrored = POINTS[[1, 0, 3, 2, 5, 4]] * [-1, 1, 1]
    assert Legs.from_points(TORSO * [-1, 1, 1], mirrored) == Legs.from_points(TORSO, POINTS)


@pytest.mark.parametrize("row", range(6))
def test_a_missing_point_is_refused(row):
    points = POINTS.copy()
    points[row, 1] = np.nan
    with pytest.raises(BodyError, match=LEG_POINTS[row]):
        Legs.from_points(TORSO, points)


def test_a_missing_torso_is_refused():
    with pytest.raises(BodyError, match="torso"):
        Legs.from_points(np.full(3, np.inf), POINTS)


@pytest.mark.parametrize("shape", [(5, 3), (6, 2), (18,)])
def test_another_number_of_points_is_refused_with_what_was_found(shape):
    with pytest.raises(BodyError, match=r"6, 3"):
        Legs.from_points(TORSO, np.zeros(shape))


@pytest.mark.parametrize(("a", "b", "name"), [(2, 0, "thigh"), (4, 2, "shank"), (1, 0, "pelvis")])
def test_points_that_coincide_are_refused(a, b, name):
    points = POINTS.copy()
    points[a], points[a ^ 1] = points[b], points[b ^ 1] if name != "pelvis" else points[0]
    with pytest.raises(BodyError, match=name):
        Legs.from_points(TORSO, points)


@pytest.mark.parametrize("unit", [100.0, 1000.0])
def test_other_units_than_metres_are_refused(unit):
    with pytest.raises(BodyError, match="metres") as error:
        Legs.from_points(unit * TORSO, unit * POINTS)
    assert "\n" not in str(error.value)


def test_legs_cannot_be_changed():
    legs = Legs.from_points(TORSO, POINTS)
    with pytest.raises(FrozenInstanceError):
        legs.thigh_m = 0.5  # type: ignore[misc]
