"""Legs that follow something else in flight: what rests on them is withheld; that of a tucked jump is not."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.motion.jumps.jump import are_legs_lost
from tests.support.jumping import Jumper, motion_of, only

CLEAN = Jumper()


def raised(rise_m, *, abruptly=False):
    """A clean jump whose ankles are pulled up towards the hips in flight, half as much the knees."""
    motion = motion_of(CLEAN)
    share = np.clip((motion.time_s - CLEAN.takeoff_s) / CLEAN.flight_s, 0, 1)
    pull_m = rise_m * (((share > 0.2) & (share < 0.8)) if abruptly else np.sin(np.pi * share) ** 2)
    points = motion.points.copy()
    points[:, 0, 2:4, 2] += pull_m[:, None] / 2
    points[:, 0, 4:6, 2] += pull_m[:, None]
    return replace(motion, points=points)


def test_legs_that_follow_something_else_take_what_rests_on_them_along_and_leave_the_hips():
    jump = only(raised(0.7, abruptly=True))
    assert jump.noise_scale > 4 and jump.tuck_m.value > 0.5
    rest_on_feet = (jump.foot_height_m, jump.flight_time_height_m, jump.takeoff_speed_height_m, jump.takeoff_s)
    assert np.isnan(rest_on_feet).all() and jump.status == "neither"
    truth = only(motion_of(CLEAN)).hip_height_m.value
    assert jump.hip_height_m.low < truth < jump.hip_height_m.high


def test_a_jump_at_a_wrong_frame_rate_keeps_its_heights():
    motion = motion_of(CLEAN)
    jump, right = only(replace(motion, time_s=1.2 * motion.time_s, rate=50.0)), only(motion)
    assert jump.noise_scale > 4
    assert jump.foot_height_m.value == pytest.approx(right.foot_height_m.value, abs=0.02)


def test_a_tuck_is_how_much_more_the_feet_rise_than_the_hips():
    straight, tucked = only(motion_of(CLEAN)), only(raised(0.1))
    assert straight.tuck_m.value == pytest.approx(0, abs=0.01)
    assert tucked.tuck_m.value == pytest.approx(0.1, abs=0.02)
    assert tucked.foot_height_m.value - tucked.hip_height_m.value == pytest.approx(tucked.tuck_m.value, abs=0.01)


def test_frames_of_uncertain_hips_are_counted_apart_from_those_of_uncertain_legs():
    motion = motion_of(CLEAN)
    status = motion.joint_status.astype("U9")
    at = round(60 * (CLEAN.takeoff_s + CLEAN.flight_s / 2))
    status[at : at + 4, 0, motion.joints.index("ankle_left")] = "uncertain"
    status[at, 0, motion.joints.index("hip_right")] = "uncertain"
    jump = only(replace(motion, joint_status=status))
    assert (jump.n_uncertain, jump.n_hips_uncertain) == (4, 1)


def test_feet_that_rise_more_than_knees_bend_are_lost_in_whatever_flight():
    assert are_legs_lost(noise_scale=1.0, tuck_m=0.7)
    assert not are_legs_lost(noise_scale=1.0, tuck_m=0.5)
    assert are_legs_lost(noise_scale=5.0, tuck_m=0.5)
