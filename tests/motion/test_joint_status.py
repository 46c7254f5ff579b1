"""A frame is tracked; a joint of it need not be."""

from fractions import Fraction

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18
from airborne.motion import JointStatus, Motion, joint_statuses, landmarks
from airborne.motion.joints import count_statuses, doubtful_segments
from airborne.tracking import Estimate, Status

HUMAN = human18()
NAMES = [landmark.name for landmark in HUMAN.landmarks]
JOINTS = tuple(segment.name for segment in HUMAN.segments[1:])


def columns(segment):
    index = HUMAN.index_of(segment)
    return np.arange(3 + 3 * index, 6 + 3 * index)


def motion(n=5, *, sd_rad=0.01, status=Status.TRACKED, wide=None, knee_deg=None):
    """Frames of the zero pose: `wide` segment -> sd of its joint [rad], `knee_deg` of the left knee by frame."""
    variances = np.full(HUMAN.n_dofs, sd_rad**2)
    for segment, sd in (wide or {}).items():
        variances[columns(segment)] = sd**2
    estimates = []
    for index in range(n):
        angles = np.zeros((HUMAN.n_joints, 3))
        angles[HUMAN.index_of("shank_left") - 1, 0] = np.radians((knee_deg or {}).get(index, 10.0))
        estimates.append(
            Estimate(
                index=index,
                time_s=Fraction(index, 50),
                status=status,
                score=5.0,
                pose=Pose(world_from_root=RigidTransform.identity(), joint_angles=angles),
                covariance=np.diag(variances),
                n_views=3,
            )
        )
    return Motion.collect(estimates, JOINTS)


def statuses(of_motion, name):
    return joint_statuses(of_motion, HUMAN, landmarks(of_motion, HUMAN)[1])[:, NAMES.index(name)].tolist()


def test_each_joint_is_counted():
    run = motion(n=4, wide={"foot_left": np.inf})
    counts = count_statuses(joint_statuses(run, HUMAN, landmarks(run, HUMAN)[1]), HUMAN)
    assert list(counts) == NAMES
    assert all(sum(of_joint.values()) == 4 for of_joint in counts.values())
    assert counts["hip_left"] == {"tracked": 4, "uncertain": 0, "unknown": 0, "lost": 0}
    assert counts["foot_left"] == {"tracked": 0, "uncertain": 0, "unknown": 4, "lost": 0}


def test_joints_with_small_deviations_are_tracked():
    for name in NAMES:
        assert statuses(motion(), name) == [JointStatus.TRACKED] * 5


def test_points_beyond_an_unobserved_joint_are_unknown_and_the_others_tracked():
    unseen = motion(wide={"forearm_left": np.inf})
    assert statuses(unseen, "wrist_left") == statuses(unseen, "hand_left") == [JointStatus.UNKNOWN] * 5
    assert statuses(unseen, "elbow_left") == statuses(unseen, "wrist_right") == [JointStatus.TRACKED] * 5


def test_points_of_unknown_deviation_are_uncertain_where_the_frame_is_tracked():
    assert statuses(motion(n=1, wide={"forearm_left": np.nan}), "wrist_left") == [JointStatus.UNCERTAIN]


def test_segments_beside_a_joint_that_is_not_tracked_are_doubtful():
    run = motion(n=2)
    run.uncertain_joints[1, JOINTS.index("shank_left")] = True
    doubtful = doubtful_segments(run, HUMAN)
    assert not doubtful[0].any()
    assert {HUMAN.segments[k].name for k in np.flatnonzero(doubtful[1])} == {"thigh_left", "shank_left"}


def test_points_with_a_large_deviation_are_uncertain():
    doubtful = motion(wide={"shank_right": 0.3})
    assert statuses(doubtful, "ankle_right") == [JointStatus.UNCERTAIN] * 5
    assert statuses(doubtful, "knee_right") == [JointStatus.TRACKED] * 5


def test_joint_that_may_lie_elsewhere_is_uncertain_however_small_its_deviation():
    run = motion(n=2)
    run.uncertain_joints[1, JOINTS.index("hand_left")] = True
    status = joint_statuses(run, HUMAN, landmarks(run, HUMAN)[1])
    is_uncertain = status == JointStatus.UNCERTAIN.value
    assert [name for name, each in zip(NAMES, is_uncertain[1], strict=True) if each] == ["wrist_left", "hand_left"]
    assert not is_uncertain[0].any() and set(status.ravel()) == {JointStatus.TRACKED, JointStatus.UNCERTAIN}


def test_joint_beyond_its_limits_is_uncertain_if_it_stays_there():
    bent = {1: -20.0, 2: -20.0, 3: -20.0}
    status = statuses(motion(knee_deg=bent), "ankle_left")
    assert status == [JointStatus.TRACKED, *[JointStatus.UNCERTAIN] * 3, JointStatus.TRACKED]
    assert statuses(motion(knee_deg={1: -20.0, 2: -20.0}), "ankle_left") == [JointStatus.TRACKED] * 5


def test_uncertain_frame_has_no_tracked_joint():
    assert set(statuses(motion(status=Status.UNCERTAIN), "knee_left")) == {JointStatus.UNCERTAIN}
