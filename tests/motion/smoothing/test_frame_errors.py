"""Errors that change from frame to frame: the surface's, without what they do to each landmark in all frames alike."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body.chain import point_jacobian
from airborne.body.human import human18
from airborne.motion import landmarks
from airborne.motion.frame_file import FRAME_SD_FILE, read_frame_deviations, write_frame_deviations
from airborne.motion.isb import isb_angles, isb_gradients
from airborne.motion.joints import _place_variance, angle_gradients, joint_angles, landmarks_with_frame_sds
from airborne.motion.motion import FrameDeviations
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
    offsets = [constant_offsets(HUMAN, np.arange(N), POSES, errors, kept=each) for each in groups]
    return frame_deviations(moved(errors), HUMAN, offsets)


def of_landmarks(errors, *groups):
    return deviations(errors, *groups).landmark_m


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
    stated = of_landmarks(errors, slice(0, N)) ** 2 - _place_variance(HUMAN)
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
    of_fit = np.sqrt(of_landmarks(errors, slice(0, N)) ** 2 - _place_variance(HUMAN))
    np.testing.assert_allclose(of_fit[:, root], NOISE_SD, rtol=1e-6)


def test_groups_of_frames_say_on_average_what_all_at_once_say():
    errors = surface_errors()
    whole, groups = of_landmarks(errors, slice(0, N)), of_landmarks(errors, slice(0, N // 3), slice(N // 3, N))
    np.testing.assert_allclose((groups**2).mean(axis=0), (whole**2).mean(axis=0), rtol=1e-9)


def test_frames_that_do_not_know_a_landmark_tell_nothing_of_its_offset():
    elbow = 6 + 3 * ([segment.name for segment in HUMAN.segments[1:]].index("forearm_left"))
    known, unknown = of_landmarks(surface_errors(), slice(0, N)), surface_errors([(4, elbow)])
    wild = SmoothErrors(unknown.covariances, unknown.of_surface.copy())
    wild.of_surface[4, elbow] = 100.0
    wrist = [mark.name for mark in HUMAN.landmarks].index("wrist_left")
    found = of_landmarks(wild, slice(0, N))
    assert np.isinf(found[4, wrist])
    others = np.delete(np.arange(N), 4)
    assert np.isfinite(found[others]).all()
    np.testing.assert_allclose(found[others, wrist], known[others, wrist], rtol=0.3)


def test_frames_that_were_not_fitted_keep_all_that_their_images_leave():
    errors = surface_errors()
    errors.of_surface[9:] = 0
    found, whole = of_landmarks(errors, slice(0, N)), landmarks(moved(errors), HUMAN)[1]
    assert (found[:9] < whole[:9]).mean() > 0.9
    assert (found[9:] > 0.9 * whole[9:]).all()


@pytest.mark.parametrize("text", [b"", b"1234567", bytes(8 * 5 * 6)])
def test_the_file_keeps_every_bit_and_a_cut_one_is_no_file(tmp_path, text):
    rng, path = np.random.default_rng(1), tmp_path / "motion.csv"
    written = FrameDeviations(rng.random((5, 3)), *rng.random((2, 5, 4, 3)))
    written.landmark_m[2, 1], written.landmark_m[3], written.angle_rad[1, 2] = np.inf, np.nan, np.inf
    write_frame_deviations(path, written)
    for mine, own in zip(read_frame_deviations(path, 5, 4), written, strict=True):
        np.testing.assert_array_equal(mine, own)
    assert read_frame_deviations(path, 7, 4) is None
    (tmp_path / FRAME_SD_FILE).write_bytes(text)
    assert read_frame_deviations(path, 5, 4) is None
    write_frame_deviations(path, None)
    assert not list(tmp_path.iterdir())


def test_a_motion_that_was_not_fitted_leaves_out_the_roots_lasting_errors_alone():
    motion = moved(surface_errors())
    wide = replace(motion, lasting=np.tile(np.diag([0.05**2] * 3 + [0.0] * 3), (N, 1, 1)))
    np.testing.assert_array_equal(landmarks_with_frame_sds(wide, HUMAN)[2], landmarks(motion, HUMAN)[1])
    table = joint_angles(wide, HUMAN)
    np.testing.assert_array_equal(table["angle_sd_frame"], table["angle_sd"])
    found = deviations(surface_errors(), slice(0, N))
    fitted = replace(wide, by_frame=found)
    assert landmarks_with_frame_sds(fitted, HUMAN)[2] is found.landmark_m
    np.testing.assert_array_equal(landmarks_with_frame_sds(wide, HUMAN)[1], landmarks(wide, HUMAN)[1])
    np.testing.assert_array_equal(joint_angles(fitted, HUMAN)["angle_sd_frame"], np.degrees(found.angle_rad))
    np.testing.assert_array_equal(isb_angles(fitted, HUMAN)["isb_angle_sd_frame"], np.degrees(found.isb_rad))


@pytest.mark.parametrize("groups", [[slice(0, N)], [slice(0, 5), slice(5, N)]])
def test_they_are_as_large_as_errors_of_angles_whose_joints_rotations_are_off_by_the_same(groups):
    errors, rng = surface_errors(), np.random.default_rng(6)
    errors = SmoothErrors(errors.covariances / 100, errors.of_surface / 10)
    turned = errors.of_surface[:, 6:] @ rng.normal(size=(K, DRAWS))
    turned += NOISE_SD / 10 * rng.normal(size=turned.shape)
    turned -= turned.mean(axis=0)
    angles, found = np.array([pose.joint_angles for pose in POSES]), deviations(errors, *groups)
    gradients = angle_gradients(angles).swapaxes(0, 1)
    for joint, (columns, of_isb) in enumerate(isb_gradients(HUMAN, angles)):
        own = gradients[joint] @ turned[:, 3 * joint : 3 * joint + 3]
        for off, stated in ((own, found.angle_rad), (of_isb @ turned[:, columns], found.isb_rad)):
            expected, is_stated = np.square(off).mean(axis=2), np.isfinite(stated[:, joint])
            share = expected[is_stated].sum() / np.square(stated[:, joint][is_stated]).sum()
            assert 1 - 1 / N - 0.03 < share < 1.03
