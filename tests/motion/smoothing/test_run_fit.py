"""A whole run is fitted at once: rows follow their derivatives, true motions cost nothing, neighbours help."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body.chain import delta_between, move_pose
from airborne.body.human import human18
from airborne.constants import FREE_FALL_M_S2
from airborne.motion.smoothing.conservation import fall_offset_m, fall_rows, momentum_rows
from airborne.motion.smoothing.run_fit import Stretch, acceleration_rows, fit_run, smooth_errors
from airborne.synthetic.flight.articulated import Takeoff, fly_articulated, joint_motion
from airborne.tracking.model_based.image_evidence import ImageEvidence

HUMAN, N, RATE = human18(1.75, 70.0), 24, 50
TIME_S = np.arange(N) / RATE
SURFACE_M = 0.004  # by which errors of the surface move the root along each axis, in all frames alike
OFFSET_M, REST = np.array([0.01, -0.02, 0.005]), np.zeros(3)


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
            of_shape = information[:3] * SURFACE_M
            evidence.append(ImageEvidence(information, gradient, 0.5 * float(away @ gradient), 1.0, of_shape))
        return evidence

    return look


def off_m(poses, rows=slice(None)):
    """The mean error of the landmarks."""
    pairs = list(zip(poses, TRUTH, strict=True))[rows]
    errors = [HUMAN.with_pose(pose).landmarks - HUMAN.with_pose(true).landmarks for pose, true in pairs]
    return float(np.linalg.norm(errors, axis=-1).mean())


@pytest.mark.parametrize("rows", ["acceleration", "fall", "momentum"])
def test_rows_follow_their_derivatives(rows):
    time_s = np.array([0.0, 0.02, 0.05])  # a frame was left out
    poses = fly(time_s)

    def at(poses):
        if rows == "fall":
            return fall_rows(HUMAN, poses, time_s, OFFSET_M)
        if rows == "momentum":
            return momentum_rows(HUMAN, poses, time_s)
        return acceleration_rows(HUMAN, poses, time_s, FREE_FALL_M_S2)

    here, step, rng = at(poses), 1e-6, np.random.default_rng(2)
    for k in range(3):
        x = rng.normal(size=HUMAN.n_dofs)
        values = [at([*poses[:k], move_pose(poses[k], sign * step * x), *poses[k + 1 :]]).values for sign in (1, -1)]
        numeric = ((values[0] - values[1]) / (2 * step))[0]
        analytic = np.einsum("gkw,gw->gk", here.by_change[0, :, :, k], x.reshape(len(numeric), -1))
        # accelerations leave out how a turn between two frames bends a change, momenta how it moves their sd
        share = {"acceleration": 0.15, "momentum": 1e-4, "fall": 1e-5}[rows]
        np.testing.assert_allclose(analytic, numeric, atol=share * abs(numeric).max())


def largest_fall_error(model, poses):
    return abs(fall_rows(model, poses, TIME_S, fall_offset_m(model, poses, TIME_S)).values).max()


def test_a_true_flight_falls_freely_and_with_masses_elsewhere_in_the_root_too_but_no_other_motion():
    root = HUMAN.segments[0]
    assert root.inertia is not None
    moved = replace(root, inertia=replace(root.inertia, centre_m=root.inertia.centre_m + np.array([0.02, -0.03, 0.01])))
    elsewhere = replace(HUMAN, segments=(moved, *HUMAN.segments[1:]))
    shaken = [pose.move(0.01 * np.sin([0.0, 20 * t, 0.0]), REST) for pose, t in zip(TRUTH, TIME_S, strict=True)]
    assert largest_fall_error(HUMAN, TRUTH) < 0.2
    assert largest_fall_error(elsewhere, TRUTH) < 0.5 < abs(fall_rows(elsewhere, TRUTH, TIME_S, REST).values).max()
    assert largest_fall_error(HUMAN, shaken) > 2


def test_nothing_turns_a_true_flight_but_one_whose_trunk_is_turned():
    turned = [pose.move(REST, 0.02 * np.sin([0.0, 20 * t, 0.0])) for pose, t in zip(TRUTH, TIME_S, strict=True)]
    assert abs(momentum_rows(HUMAN, TRUTH, TIME_S).values).max() < 0.2
    assert abs(momentum_rows(HUMAN, turned, TIME_S).values).max() > 1


def test_steady_motion_has_no_acceleration_but_gravity():
    step = np.zeros(HUMAN.n_dofs)
    step[[0, 4, 20]] = 0.02, 0.1, 0.05
    poses = [TRUTH[0]]
    for _ in range(5):
        poses.append(move_pose(poses[-1], step))
    np.testing.assert_allclose(acceleration_rows(HUMAN, poses, TIME_S[:6], REST).values, 0, atol=1e-6)
    falling = acceleration_rows(HUMAN, poses, TIME_S[:6], FREE_FALL_M_S2).values
    np.testing.assert_allclose(falling[:, 0, :2], 0, atol=1e-6)
    assert (falling[:, 0, 2] > 0).all()


@pytest.mark.parametrize("falls", [False, True])
def test_noise_of_single_frames_is_less_after(falls):
    tracked = shake(TRUTH)
    fitted = fit_run(HUMAN, tracked, TIME_S, [Stretch(slice(0, N), falls)], seen(tracked)).poses
    assert off_m(fitted) < 0.7 * off_m(tracked)


def test_a_free_fall_tells_where_the_body_is():
    tracked = shake(TRUTH)
    free, held = (
        fit_run(HUMAN, tracked, TIME_S, [Stretch(slice(0, N), falls)], seen(tracked)).poses for falls in (False, True)
    )
    assert off_m(held) < 0.95 * off_m(free)


def test_neighbours_tell_of_a_frame_whose_images_show_nothing_and_that_lay_far_off():
    tracked = shake(TRUTH, sd=0.005)
    lost = move_pose(tracked[10], np.repeat([0.3, 0.0, 0.5], [3, 3, HUMAN.n_dofs - 6]))
    start = [*tracked[:10], lost, *tracked[11:]]
    look = seen(start, sd=0.005, unseen=(10,))
    fitted = fit_run(HUMAN, start, TIME_S, [Stretch(slice(0, N), falls=True)], look).poses
    assert off_m(start, slice(10, 11)) > 0.3
    assert off_m(fitted, slice(10, 11)) < 0.01


def test_stretches_do_not_know_of_each_other_and_frames_outside_stay():
    tracked = shake(TRUTH)
    halves = [Stretch(slice(0, 10), falls=False), Stretch(slice(12, N), falls=False)]
    both = fit_run(HUMAN, tracked, TIME_S, halves, seen(tracked)).poses
    moved = fit_run(HUMAN, tracked, TIME_S, halves, seen([*tracked[:12], *shake(TRUTH, seed=5)[12:]])).poses
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

    fitted = fit_run(HUMAN, tracked, TIME_S, [Stretch(slice(0, N), falls=False)], look).poses
    assert all(a is b for a, b in zip(fitted, tracked, strict=True))


@pytest.mark.parametrize("falls", [False, True])
def test_covariances_hold_the_errors_that_smooth_motion_leaves(falls):
    sd, n_runs = 0.03, 8
    stretches, covariances = [Stretch(slice(0, N), falls)], np.tile(sd**2 * np.eye(HUMAN.n_dofs), (N, 1, 1))
    shares = []
    for seed in range(n_runs):
        fit = fit_run(HUMAN, TRUTH, TIME_S, stretches, seen(shake(TRUTH, sd, seed)))
        silent = [replace(each, of_shape=0 * each.of_shape) for each in fit.evidence]
        left = smooth_errors(HUMAN, fit._replace(evidence=silent), TIME_S, stretches, covariances).covariances
        errors = np.array([delta_between(true, pose) for true, pose in zip(TRUTH, fit.poses, strict=True)])
        shares.append(np.mean(errors**2 / np.diagonal(left, axis1=1, axis2=2)))
        assert (np.diagonal(left, axis1=1, axis2=2) < 0.9 * sd**2).all()
    assert 0.6 < np.mean(shares) < 1.2


def test_errors_of_the_surface_pass_the_fit_as_they_are_and_open_directions_stay_open():
    covariances = np.tile(0.03**2 * np.eye(HUMAN.n_dofs), (N, 1, 1))
    covariances[5, 20, 20] = np.inf
    fit, stretches = (
        fit_run(HUMAN, TRUTH, TIME_S, [Stretch(slice(0, N), False)], seen(TRUTH)),
        [Stretch(slice(0, 20), False)],
    )
    silent = fit._replace(evidence=[replace(each, of_shape=0 * each.of_shape) for each in fit.evidence])
    both = smooth_errors(HUMAN, fit, TIME_S, stretches, covariances).covariances
    without = smooth_errors(HUMAN, silent, TIME_S, stretches, covariances).covariances
    added = np.diagonal(both[:20, :3, :3] - without[:20, :3, :3], axis1=1, axis2=2)
    np.testing.assert_allclose(added, SURFACE_M**2, rtol=0.05)
    assert np.argwhere(np.isinf(np.diagonal(both, axis1=1, axis2=2))).tolist() == [[5, 20]]
    np.testing.assert_array_equal(both[20:], covariances[20:])
