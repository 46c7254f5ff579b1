"""Why joints of players are uncertain: each reason with its joints and frames, in one line."""

from dataclasses import replace

import numpy as np

from airborne.motion.players_doubts import describe_player_doubts
from tests.support.jumping import Jumper, motion_of

MOTION = motion_of(Jumper(), feet=True)


def doubted(rows, joints, *, sd_m=1e-3, n_views=3):
    """The motion with joints that are uncertain at rows, with an sd, seen by so many cameras."""
    status, covariance, views = MOTION.joint_status.astype("U9"), MOTION.covariance.copy(), MOTION.n_views.copy()
    at = [MOTION.joints.index(joint) for joint in joints]
    for row in rows:
        status[row, 0, at], covariance[row, 0, at], views[row, 0] = "uncertain", sd_m**2 * np.eye(3), n_views
    return replace(MOTION, joint_status=status, covariance=covariance, n_views=views)


def said(motion, **judged):
    return list(describe_player_doubts(motion, "one", most_sd_m=0.06, **judged))


def test_of_a_tracked_player_nothing_is_said():
    assert said(MOTION) == []


def test_joints_with_the_same_frames_stand_together_whichever_side_they_are_on():
    left, right = ("ankle_left", "foot_left"), ("ankle_right", "foot_right")
    early, late = doubted(range(29, 43), left, sd_m=0.07), doubted(range(31, 56), right, sd_m=0.07)
    status = np.where(late.joint_status == "uncertain", late.joint_status, early.joint_status)
    both = replace(early, joint_status=status, covariance=np.maximum(early.covariance, late.covariance))
    assert said(both) == ["ankles and feet in frames 29 to 55: sd over 6 cm"]
    assert said(early) == ["left ankle and left foot in frames 29 to 42: sd over 6 cm"]


def test_each_reason_is_named_and_frames_between_that_are_tracked_are_not_counted():
    alone = doubted([3, 5, 9], MOTION.joints, n_views=1)
    assert said(alone) == ["all joints in 3 of frames 3 to 9: fewer than two cameras show the player"]
    assert said(doubted([4], ["knee_right"])) == ["right knee in frame 4: images show them worse than usual"]


def test_where_one_joint_makes_all_uncertain_its_sd_is_the_reason_of_all():
    motion = doubted([4], MOTION.joints)
    motion.covariance[4, 0, 2] = 0.07**2 * np.eye(3)
    assert said(motion, is_joint_alone=False) == ["all joints in frame 4: sd over 6 cm"]
