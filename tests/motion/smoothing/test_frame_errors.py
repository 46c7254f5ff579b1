"""Errors that change from frame to frame: the surface's, without what they do to each landmark in all frames alike."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body.chain import point_jacobian
from airborne.body.human import human18
from airborne.motion import landmarks
from airborne.motion.covariance_file import read_frame_sds, write_frame_sds
from airborne.motion.joints import _place_variance, landmark_frame_sds
from airborne.motion.smoothing.frame_errors import constant_offsets, frame_deviations
from airborne.motion.smoothing.run_fit import SmoothErrors
from tests.support.motions import motion_of, swinging

HUMAN, N, K, NOISE_SD, DRAWS = human18(1.75, 70.0), 12, 5, 0.003, 4000
POSES = swinging(HUMAN, np.arange(N) / 20)  # limbs turn far against each other


def surface_errors(unknown=()):
    """Errors of the surface that move the poses alike but not quite, and noise of single frames."""
    rng = np.random.default_rng(3)
    of_surface = 0.01 * (rng.normal(size=(HUMAN.n_dofs, K)) + 0.2 * rng.normal(size=(N, HUMAN.n_dofs, K)))
    covariances = of_surface @ of_surface.swapaxes(1, 2) + NOISE_SD**2 * np.eye(HUMAN.n_dofs)
    for row, column in unknown:
        covariances[row, column, :] = covariances[row, :, column] = 0.0
        covariances[row, column, column] = np.inf
    return SmoothErrors(covariances, of_surface)


def moved(errors):
    """The motion whose poses have these errors."""
    return replace(motion_of(HUMAN, POSES), covariance=errors.covariances)


def deviations(errors, *groups):
    rows = np.arange(N)
    return frame_deviations(
        moved(errors), HUMAN, [constant_offsets(HUMAN, rows, POSES, errors, each) for each in groups]
    )


def test_they_are_as_large_as_errors_of_landmarks_without_constant_offsets():
    errors, rng = surface_errors(), np.random.default_rng(5)
    owners = np.array([HUMAN.index_of(mark.segment) for mark in HUMAN.landmarks])
    at_joint = np.array([mark.at_joint for mark in HUMAN.landmarks])[:, None]
    lasting, off = rng.normal(size=(K, DRAWS)), np.zeros((N, len(owners), 3, DRAWS))
    for row, pose in enumerate(POSES):
        posed = HUMAN.with_pose(pose)
        places = np.where(at_joint, posed.t[owners], posed.landmarks)
        x = errors.of_surface[row] @ lasting + NOISE_SD * rng.normal(size=(HUMAN.n_dofs, DRAWS))
        off[row] = posed.R[owners].swapaxes(1, 2) @ (point_jacobian(posed, owners, places) @ x)
    squares = np.square(off - off.mean(axis=0)).mean(axis=(2, 3))
    stated = deviations(errors, slice(0, N)) ** 2 - _place_variance(HUMAN)
    # noise of single frames is stated whole, of which their mean takes a twelfth
    np.testing.assert_allclose(squares.mean(axis=0), stated.mean(axis=0), rtol=1 / N + 0.02)


def test_errors_that_turn_with_each_segment_alone_leave_the_noise():
    """Of the root, shifted along its own axes."""
    root = [k for k, mark in enumerate(HUMAN.landmarks) if HUMAN.index_of(mark.segment) == 0]
    of_surface = np.zeros((N, HUMAN.n_dofs, 3))
    of_surface[:, :3] = [0.02 * pose.world_from_root.rotation.as_matrix() for pose in POSES]
    noise = NOISE_SD**2 * np.eye(HUMAN.n_dofs)
    noise[3:] = 0
    errors = SmoothErrors(of_surface @ of_surface.swapaxes(1, 2) + noise, of_surface)
    of_fit = np.sqrt(deviations(errors, slice(0, N)) ** 2 - _place_variance(HUMAN))
    np.testing.assert_allclose(of_fit[:, root], NOISE_SD, rtol=1e-6)


def test_groups_of_frames_say_on_average_what_all_at_once_say():
    errors = surface_errors()
    whole, groups = deviations(errors, slice(0, N)), deviations(errors, slice(0, N // 3), slice(N // 3, N))
    np.testing.assert_allclose((groups**2).mean(axis=0), (whole**2).mean(axis=0), rtol=1e-9)


def test_frames_that_do_not_know_a_landmark_tell_nothing_of_its_offset():
    elbow = 6 + 3 * ([segment.name for segment in HUMAN.segments[1:]].index("forearm_left"))
    known, unknown = deviations(surface_errors(), slice(0, N)), surface_errors([(4, elbow)])
    wild = SmoothErrors(unknown.covariances, unknown.of_surface.copy())
    wild.of_surface[4, elbow] = 100.0
    wrist = [mark.name for mark in HUMAN.landmarks].index("wrist_left")
    found = deviations(wild, slice(0, N))
    assert np.isinf(found[4, wrist])
    others = np.delete(np.arange(N), 4)
    assert np.isfinite(found[others]).all()
    np.testing.assert_allclose(found[others, wrist], known[others, wrist], rtol=0.3)


def test_frames_that_were_not_fitted_keep_all_that_their_images_leave():
    errors = surface_errors()
    errors.of_surface[9:] = 0
    found, whole = deviations(errors, slice(0, N)), landmarks(moved(errors), HUMAN)[1]
    assert (found[:9] < whole[:9]).mean() > 0.9
    assert (found[9:] > 0.9 * whole[9:]).all()


@pytest.mark.parametrize("text", [b"", b"1234567"])
def test_the_file_keeps_every_bit_and_a_cut_one_is_no_file(tmp_path, text):
    sds, path = np.random.default_rng(1).random((5, 3)), tmp_path / "motion.csv"
    sds[2, 1], sds[3] = np.inf, np.nan
    write_frame_sds(path, sds)
    np.testing.assert_array_equal(read_frame_sds(path, 5), sds)
    assert read_frame_sds(path, 7) is None
    (tmp_path / "frame_sd.bin").write_bytes(text)
    assert read_frame_sds(path, 5) is None
    write_frame_sds(path, None)
    assert not list(tmp_path.iterdir())


def test_a_motion_that_was_not_fitted_leaves_out_the_roots_lasting_errors_alone():
    motion = moved(surface_errors())
    wide = replace(motion, lasting=np.tile(np.diag([0.05**2] * 3 + [0.0] * 3), (N, 1, 1)))
    np.testing.assert_array_equal(landmark_frame_sds(wide, HUMAN), landmarks(motion, HUMAN)[1])
    fitted = replace(wide, landmark_frame_sd=np.ones((N, len(HUMAN.landmarks))))
    assert (landmark_frame_sds(fitted, HUMAN) == 1).all()
