"""A start that lacks a joint, or puts one nowhere, is refused in one line."""

import numpy as np
import pytest

from airborne.body.legs import LEG_POINTS
from airborne.errors import AirborneError, BodyError, TrialError
from airborne.tracking.capsules import Blocker
from airborne.tracking.players import PlayerStart


def begun(hall, joints):
    blocker = Blocker([PlayerStart(name="anna", joints_m=joints)])
    return blocker.step(blocker.init(), hall.frames(0))


@pytest.mark.parametrize("missing", ["torso", *(name for name in LEG_POINTS if name != "hip_left")])
def test_a_missing_joint_is_named(hall, missing):
    joints = {name: point for name, point in hall.starts()[0].joints_m.items() if name != missing}
    with pytest.raises(TrialError, match=missing) as error:
        begun(hall, joints)
    assert "\n" not in str(error.value) and "anna" in str(error.value)


def test_a_missing_left_hip_is_named(hall):
    joints = {name: point for name, point in hall.starts()[0].joints_m.items() if name != "hip_left"}
    with pytest.raises(TrialError, match="hip_left"):
        begun(hall, joints)


def test_a_bystander_with_a_torso_only_is_left_out(hall):
    bystander = PlayerStart(name="referee", joints_m={"torso": np.array([2.0, 2.0, 1.2])})
    blocker = Blocker([*hall.starts(), bystander])
    _, estimates = blocker.step(blocker.init(), hall.frames(0))
    assert [each.player for each in estimates] == ["anna"]


def test_feet_may_be_left_out(hall):
    joints = {name: point for name, point in hall.starts()[0].joints_m.items() if not name.startswith("foot")}
    _, [estimate] = begun(hall, joints)
    np.testing.assert_allclose(estimate.points[:6], hall.truth("anna", 0)[:6], atol=0.04)


def test_a_joint_without_a_place_is_refused(hall):
    joints = {**hall.starts()[0].joints_m, "knee_left": np.full(3, np.nan)}
    with pytest.raises(BodyError, match="missing") as error:
        begun(hall, joints)
    assert "\n" not in str(error.value)


def test_millimetres_are_refused(hall):
    joints = {name: 1000 * point for name, point in hall.starts()[0].joints_m.items()}
    with pytest.raises(AirborneError, match="metres"):
        begun(hall, joints)


def test_a_player_in_no_picture_is_named(hall):
    joints = {name: point + np.array([80.0, 0, 0]) for name, point in hall.starts()[0].joints_m.items()}
    with pytest.raises(TrialError, match="anna") as error:
        begun(hall, joints)
    assert "\n" not in str(error.value)
