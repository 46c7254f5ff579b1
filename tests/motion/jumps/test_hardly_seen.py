"""Frames of a jump that one camera alone saw, or that are uncertain: what rests on them is not stated."""

from dataclasses import replace

import numpy as np

from airborne.export.players_notes import jump_notes
from airborne.motion.jumps.table import jump_row
from tests.support.jumping import G, Jumper, motion_of, only

CLEAN = Jumper()


def test_a_take_off_that_one_camera_alone_saw_is_not_stated():
    motion = motion_of(CLEAN)
    begins = np.abs(motion.time_s - CLEAN.takeoff_s) < 0.15
    status, n_views = motion.joint_status.astype("<U9"), motion.n_views.copy()
    status[begins], n_views[begins] = "uncertain", 1
    jump = only(replace(motion, joint_status=status, n_views=n_views))
    assert jump.status == "no take-off" and np.isnan(jump.takeoff_speed_height_m).all()
    assert np.isfinite(jump.landing_s).all() and np.isfinite(jump.hip_height_m).all()


def test_events_near_which_no_ankle_is_tracked_are_not_stated_though_two_cameras_saw_them():
    status = motion_of(CLEAN).joint_status.astype("<U9")
    status[3:, :, -2:] = "uncertain"
    jump = only(replace(motion_of(CLEAN), joint_status=status))
    assert jump.status == "neither" and np.isnan([*jump.flight_time_height_m, *jump.takeoff_speed_height_m]).all()
    assert np.isfinite(jump.hip_height_m).all()
    assert any("take-off and landing are not known" in note for note in jump_notes(jump_row(jump)))
    status[-50:, :, -1] = "tracked"
    assert only(replace(motion_of(CLEAN), joint_status=status)).status == "no take-off"


def test_a_peak_that_one_camera_alone_saw_has_no_height():
    motion = motion_of(CLEAN)
    jump = only(motion)
    in_the_air = (motion.time_s > jump.takeoff_s.value) & (motion.time_s < jump.landing_s.value)
    status, n_views = motion.joint_status.astype("<U9"), motion.n_views.copy()
    status[in_the_air], n_views[in_the_air] = "uncertain", 1
    unseen = only(replace(motion, joint_status=status, n_views=n_views))
    assert np.isfinite(jump.foot_height_m.value)
    assert np.isnan(unseen.foot_height_m.value) and np.isnan(unseen.hip_height_m.value)


def test_a_player_of_whom_no_frame_is_tracked_has_no_height():
    motion = motion_of(CLEAN)
    jump = only(replace(motion, joint_status=np.full(motion.joint_status.shape, "uncertain")))
    assert np.isnan([*jump.hip_height_m, *jump.foot_height_m, *jump.flight_time_height_m]).all()


def test_uncertain_frames_of_the_flight_are_counted_and_those_of_the_floor_are_not():
    motion = motion_of(CLEAN)
    status = motion.joint_status.astype("U9")
    at = round(60 * (CLEAN.takeoff_s + CLEAN.speed_m_s / G))
    status[at : at + 4] = status[0] = "uncertain"
    jump = only(replace(motion, joint_status=status))
    assert (only(motion).n_uncertain, jump.n_uncertain) == (0, 4)
