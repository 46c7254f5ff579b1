"""A limb that is lost for some frames, and seen somewhere else there: the fit of a run starts on its way."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.motion import Motion, landmarks
from airborne.motion.smoothing.lost_limbs import bridge_lost_limbs
from airborne.motion.smoothing.moved_joints import count_moves_as_errors, forget_moved_limbs
from airborne.motion.smoothing.run_fit import Stretch
from airborne.tracking import Estimate, Status
from airborne.tracking.model_based.degrees_of_freedom import joints_of, limbs_of
from airborne.tracking.model_based.misplaced_limbs import DISTINCT_M, limb_distance
from tests.motion.smoothing.test_run_fit import HUMAN, TIME_S, TRUTH, N

ARM = next(limb for limb in limbs_of(HUMAN) if HUMAN.segments[limb[0]].name == "shoulder_left")
COLUMNS = joints_of(HUMAN, ARM).columns
WHOLE = [Stretch(slice(0, N), falls=True)]


def lose(rows, turned_rad=1.2, is_known=False):
    """The true poses with an arm turned away in some rows, and covariances that do not know it there, or do."""
    poses, covariances = list(TRUTH), np.tile(1e-4 * np.eye(HUMAN.n_dofs), (N, 1, 1))
    for row in rows:
        angles = poses[row].joint_angles.copy()
        angles[ARM[1] - 1] += [turned_rad, 0, 0]  # the upper arm
        poses[row] = replace(poses[row], joint_angles=angles)
        if not is_known:
            covariances[row, COLUMNS, COLUMNS] = np.inf
    return poses, covariances


def off_m(poses, rows=range(N)):
    return max(limb_distance(HUMAN, poses[row], TRUTH[row], ARM) for row in rows)


@pytest.mark.parametrize("rows", [[8], [8, 9, 10], [5, 6, 14, 15]])
def test_lost_limb_starts_from_its_way_between_the_frames_that_know_it(rows):
    poses, covariances = lose(rows)
    assert off_m(poses) > 0.4
    bridged = bridge_lost_limbs(HUMAN, poses, TIME_S, covariances=covariances, stretches=WHOLE)
    assert off_m(bridged) < 0.02
    assert all(bridged[row] is poses[row] for row in range(N) if row not in rows)


def test_unknown_frames_before_and_after_the_jumps_stay():
    poses, covariances = lose([8, 9, 10])
    for row in (6, 7, 11, 12):
        covariances[row, COLUMNS, COLUMNS] = np.inf
    bridged = bridge_lost_limbs(HUMAN, poses, TIME_S, covariances=covariances, stretches=WHOLE)
    assert off_m(bridged) < 0.02
    assert [row for row in range(N) if bridged[row] is not poses[row]] == [8, 9, 10]


def test_limb_that_jumps_back_from_where_it_was_led_is_led_anew_all_the_way():
    poses, covariances = list(TRUTH), lose(range(6, 12))[1]
    for row, turned_rad in zip(range(6, 12), np.linspace(0.1, 1.4, 6), strict=True):
        poses[row] = lose([row], turned_rad)[0][row]
    bridged = bridge_lost_limbs(HUMAN, poses, TIME_S, covariances=covariances, stretches=WHOLE)
    assert off_m(poses) > 0.4
    assert off_m(bridged) < 0.05


def test_limb_that_is_known_or_does_not_jump_stays_where_it_was_tracked():
    for poses, covariances in (lose([8, 9], is_known=True), lose([8, 9], turned_rad=0.1)):
        assert bridge_lost_limbs(HUMAN, poses, TIME_S, covariances=covariances, stretches=WHOLE) == poses


def test_limb_is_not_led_across_a_landing_nor_where_no_frame_knows_it_on_one_side():
    poses, covariances = lose([10, 11, 12, 13])
    landing = [Stretch(slice(0, 12), falls=True), Stretch(slice(12, N), falls=False)]
    assert bridge_lost_limbs(HUMAN, poses, TIME_S, covariances=covariances, stretches=landing) == poses
    poses, covariances = lose(range(18, N))
    assert bridge_lost_limbs(HUMAN, poses, TIME_S, covariances=covariances, stretches=WHOLE) == poses


def motion_of(poses, sd_rad=0.01):
    sd = np.repeat([0.01, sd_rad], [3, HUMAN.n_dofs - 3])
    estimates = [
        Estimate(
            index=k,
            time_s=Fraction(k, 50),
            status=Status.TRACKED,
            score=5.0,
            pose=pose,
            covariance=np.diag(sd**2),
            n_views=3,
        )
        for k, pose in enumerate(poses)
    ]
    return Motion.collect(estimates, tuple(segment.name for segment in HUMAN.segments[1:]))


def test_limb_that_the_fit_moves_away_from_where_it_was_tracked_is_not_known():
    true, lost = motion_of(TRUTH), motion_of(lose([8])[0])
    is_known = np.isfinite(np.diagonal(forget_moved_limbs(HUMAN, lost, true).covariance, axis1=1, axis2=2))
    assert not is_known[8, COLUMNS].any()
    assert is_known.sum() == is_known.size - len(COLUMNS)
    assert np.array_equal(forget_moved_limbs(HUMAN, true, true).covariance, true.covariance)


def test_limb_that_the_fit_moves_no_further_than_its_deviations_allow_stays_known():
    true, vague = motion_of(TRUTH), motion_of(lose([8], turned_rad=0.4)[0], sd_rad=0.2)
    assert off_m([vague.pose(row) for row in range(N)]) > DISTINCT_M
    assert np.isfinite(np.diagonal(forget_moved_limbs(HUMAN, vague, true).covariance, axis1=1, axis2=2)).all()


def test_what_the_fit_moves_by_more_than_its_deviation_is_at_least_as_uncertain():
    true, turned = motion_of(TRUTH), motion_of(lose([8], turned_rad=0.3)[0])
    doubtful = count_moves_as_errors(HUMAN, turned, true)
    moved_m = np.linalg.norm(landmarks(turned, HUMAN)[0] - landmarks(true, HUMAN)[0], axis=-1)
    before, after = landmarks(true, HUMAN)[1], landmarks(doubtful, HUMAN)[1]
    assert moved_m[8].max() > 0.1
    np.testing.assert_allclose(after[8], np.sqrt(before[8] ** 2 + moved_m[8] ** 2 / 3), rtol=0.02)  # to first order
    others = np.arange(N) != 8
    np.testing.assert_array_equal(after[others], before[others])


def test_a_small_move_and_an_unknown_spin_leave_what_is_known_as_it_is():
    near, true = motion_of(lose([8], turned_rad=0.01)[0]), motion_of(TRUTH)
    assert np.array_equal(count_moves_as_errors(HUMAN, near, true).covariance, true.covariance)
    true.covariance[:, COLUMNS[-1], COLUMNS[-1]] = np.inf
    turned = motion_of(lose([8], turned_rad=0.3)[0])
    is_known = np.isfinite(count_moves_as_errors(HUMAN, turned, true).covariance)
    assert np.array_equal(is_known, np.isfinite(true.covariance))
