"""A whole run is fitted at once: rows follow their derivatives, true motions cost nothing, neighbours help."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body.chain import delta_between, move_pose
from airborne.body.human import human18
from airborne.constants import FREE_FALL_M_S2
from airborne.motion.smoothing.run_fit import Stretch, acceleration_rows, fall_rows, fit_run
from airborne.synthetic.flight.articulated import Takeoff, fly_articulated, joint_motion
from airborne.tracking.model_based.image_evidence import ImageEvidence

HUMAN, N, RATE = human18(1.75, 70.0), 24, 50
TIME_S = np.arange(N) / RATE
OFFSET_M = np.array([0.01, -0.02, 0.005])
NO_OFFSET = np.zeros(3)


def fly(time_s=TIME_S):
    """A somersault in which arms go down and knees bend: true poses (n,)."""
    first, last = np.zeros((2, HUMAN.n_joints, 3))
    names = [segment.name for segment in HUMAN.segments[1:]]
    first[[name.startswith("upper_arm") for name in names]] = [-0.8, 0, 0]
    last[[name.startswith("shank") for name in names]] = [0.7, 0, 0]
    takeoff = Takeoff(
        centre=np.ones(3), velocity=np.array([0, -1.0, 3]), R=np.eye(3), angular_momentum=np.array([60.0, 4.0, -3.0])
    )
    flight = fly_articulated(HUMAN, takeoff, joint_motion(np.array([0.0, 0.6]), np.stack([first, last])), time_s)
    return [flight.pose(k) for k in range(len(time_s))]


TRUTH = fly()


def shake(poses, sd=0.03, seed=1):
    rng = np.random.default_rng(seed)
    return [move_pose(pose, sd * rng.normal(size=HUMAN.n_dofs)) for pose in poses]


def seen(targets, sd=0.03, unseen=()):
    """A look at images that show each frame's target pose alone, with this sd; some frames show nothing."""

    def look(poses):
        evidence = []
        for k, (pose, target) in enumerate(zip(poses, targets, strict=True)):
            information = np.eye(HUMAN.n_dofs) * (k not in unseen) / sd**2
            away = delta_between(pose, target)
            gradient = information @ away
            evidence.append(ImageEvidence(information, gradient, 0.5 * float(away @ gradient), 1.0))
        return evidence

    return look


def off_m(poses, rows=slice(None)):
    """The mean error of the landmarks."""
    pairs = list(zip(poses, TRUTH, strict=True))[rows]
    errors = [HUMAN.with_pose(pose).landmarks - HUMAN.with_pose(true).landmarks for pose, true in pairs]
    return float(np.linalg.norm(errors, axis=-1).mean())


@pytest.mark.parametrize("rows", ["acceleration", "fall"])
def test_rows_follow_their_derivatives(rows):
    time_s = np.array([0.0, 0.02, 0.05])  # a frame was left out
    poses = fly(time_s)

    def at(poses):
        if rows == "fall":
            return fall_rows(HUMAN, poses, time_s, OFFSET_M)
        return acceleration_rows(poses, time_s, FREE_FALL_M_S2)

    here, step, rng = at(poses), 1e-6, np.random.default_rng(2)
    for k in range(3):
        x = rng.normal(size=HUMAN.n_dofs)
        values = [at([*poses[:k], move_pose(poses[k], sign * step * x), *poses[k + 1 :]]).values for sign in (1, -1)]
        numeric = ((values[0] - values[1]) / (2 * step))[0]
        analytic = here.by_change[0, :, k] @ x
        # accelerations leave out how a turn between two frames bends a change, to second order of that turn
        np.testing.assert_allclose(
            analytic, numeric, atol=(0.15 if rows == "acceleration" else 1e-5) * abs(numeric).max()
        )


def test_a_true_flight_falls_and_one_with_other_masses_falls_beside():
    values = fall_rows(HUMAN, TRUTH, TIME_S, NO_OFFSET).values
    assert abs(values).max() < 0.2
    assert abs(fall_rows(HUMAN, TRUTH, TIME_S, OFFSET_M).values).max() > 10 * abs(values).max()


def test_steady_motion_has_no_acceleration_but_gravity():
    step = np.zeros(HUMAN.n_dofs)
    step[[0, 4, 20]] = 0.02, 0.1, 0.05
    poses = [TRUTH[0]]
    for _ in range(5):
        poses.append(move_pose(poses[-1], step))
    np.testing.assert_allclose(acceleration_rows(poses, TIME_S[:6], NO_OFFSET).values, 0, atol=1e-6)
    falling = acceleration_rows(poses, TIME_S[:6], FREE_FALL_M_S2).values
    np.testing.assert_allclose(falling[:, :2], 0, atol=1e-6)
    assert (falling[:, 2] > 0).all()


@pytest.mark.parametrize("offset", [None, NO_OFFSET])
def test_noise_of_single_frames_is_less_after(offset):
    tracked = shake(TRUTH)
    fitted = fit_run(HUMAN, tracked, TIME_S, [Stretch(slice(0, N), offset)], seen(tracked))
    assert off_m(fitted) < 0.6 * off_m(tracked)


def test_a_free_fall_tells_where_the_body_is():
    tracked = shake(TRUTH)
    free, held = (
        fit_run(HUMAN, tracked, TIME_S, [Stretch(slice(0, N), offset)], seen(tracked)) for offset in (None, NO_OFFSET)
    )
    assert off_m(held) < 0.95 * off_m(free)


def test_neighbours_tell_of_a_frame_whose_images_show_nothing_and_that_lay_far_off():
    tracked = shake(TRUTH, sd=0.005)
    lost = move_pose(tracked[10], np.repeat([0.3, 0.0, 0.5], [3, 3, HUMAN.n_dofs - 6]))
    start = [*tracked[:10], lost, *tracked[11:]]
    look = seen(start, sd=0.005, unseen=(10,))
    fitted = fit_run(HUMAN, start, TIME_S, [Stretch(slice(0, N), NO_OFFSET)], look)
    assert off_m(start, slice(10, 11)) > 0.3
    assert off_m(fitted, slice(10, 11)) < 0.01


def test_stretches_do_not_know_of_each_other_and_frames_outside_stay():
    tracked = shake(TRUTH)
    halves = [Stretch(slice(0, 10), None), Stretch(slice(12, N), None)]
    both = fit_run(HUMAN, tracked, TIME_S, halves, seen(tracked))
    moved = fit_run(HUMAN, tracked, TIME_S, halves, seen([*tracked[:12], *shake(TRUTH, seed=5)[12:]]))
    for k in range(12):
        assert abs(delta_between(both[k], moved[k])).max() < 1e-9
    assert max(abs(delta_between(both[k], moved[k])).max() for k in range(12, N)) > 1e-3
    assert all(both[k] is tracked[k] for k in (10, 11))


def test_a_step_that_raises_the_cost_is_shortened():
    """Images that promise a gain and show a loss."""
    tracked = shake(TRUTH)
    honest = seen(TRUTH)

    def look(poses):
        gained = float(sum(abs(delta_between(a, b)).sum() for a, b in zip(poses, tracked, strict=True)))
        return [replace(each, cost=1e6 * gained) for each in honest(poses)]

    fitted = fit_run(HUMAN, tracked, TIME_S, [Stretch(slice(0, N), None)], look)
    assert all(a is b for a, b in zip(fitted, tracked, strict=True))
