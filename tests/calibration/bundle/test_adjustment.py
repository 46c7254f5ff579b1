"""The adjustment: oracles, truth, honest standard deviations, outliers, cameras that look late."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.stats import chi2

from airborne.calibration.bundle import ALL_FIXED, CameraPrior, FreeParameters, Lengths, ObservationLags, adjust
from airborne.calibration.initial.chaining import board_source
from airborne.calibration.intrinsics.physical import PINHOLE_MODELS, Pinhole, fit_pinhole
from airborne.cameras import Rig
from airborne.errors import CalibrationError
from tests.support.rigs import BROWN, FISHEYE, MIDDLE, apart, boards, observe_board, observe_points, ring, shaken
from tests.support.tolerances import SOLVED

ALL = FreeParameters(principal_point=True, n_terms=5)


def board_of(rng, rig, n=40, noise_px=0.3):
    places = boards(rng, n)
    return board_source(observe_board(rng, rig, places, noise_px=noise_px), places)


@pytest.mark.parametrize(("lens", "distortion", "n_terms"), [("brown", BROWN, 4), ("fisheye", FISHEYE, 4)])
def test_without_noise_the_rig_is_found(lens, distortion, n_terms):
    rng = np.random.default_rng(0)
    rig = ring(4, distortion=distortion, lens=lens)
    source = board_of(rng, rig, n=60, noise_px=0.0)
    found = adjust(shaken(rng, rig), [source], FreeParameters(principal_point=True, n_terms=n_terms))
    assert found.has_converged
    assert found.is_gauge_free
    assert found.rms_px() < 1e-3
    np.testing.assert_allclose(apart(found.rig), apart(rig), atol=SOLVED)
    for camera, true in zip(found.rig, rig, strict=True):
        np.testing.assert_allclose(camera.K, true.K, atol=0.05)


def test_one_lens_is_that_of_opencv():
    rng = np.random.default_rng(1)
    rig = Rig((ring(1).cameras[0],))
    places = boards(rng, 60)
    views = observe_board(rng, rig, places)
    own = views.of_camera(0)
    corners = [views.board.corners[s.corner].astype(np.float32) for s in own.detections[0]]
    px = [s.px.astype(np.float32)[:, None] for s in own.detections[0]]
    flags = cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_USE_INTRINSIC_GUESS
    K = rig.cameras[0].K.copy()
    rms, K, distortion, *_ = cv2.calibrateCamera(corners, px, rig.cameras[0].size, K, np.zeros(5), flags=flags)
    found = adjust(rig, [board_source(views, places)], replace(ALL, extrinsics=False), loss="squares")
    assert found.rms_px() == pytest.approx(rms, rel=1e-4)
    np.testing.assert_allclose(found.rig.cameras[0].K, K, atol=0.05)
    np.testing.assert_allclose(found.rig.cameras[0].distortion, distortion.ravel(), atol=0.02)


def test_where_one_camera_stands_says_nothing_of_its_lens():
    rng = np.random.default_rng(1)
    rig = Rig((ring(1).cameras[0],))
    source = board_of(rng, rig)
    free, held = (adjust(rig, [source], FreeParameters(n_terms=2, extrinsics=each)) for each in (True, False))
    assert free.is_gauge_free and not held.is_gauge_free
    np.testing.assert_allclose(free.camera_sd[0, 6:], held.camera_sd[0, 6:], rtol=0.01)  # six fewer degrees of freedom
    np.testing.assert_allclose(free.camera_sd[0, :6], 0, atol=1e-9)
    assert np.isfinite(free.rig.cameras[0].covariance).all()


def test_two_cameras_are_those_of_opencv():
    rng = np.random.default_rng(2)
    first = ring(4).cameras[0]
    second = replace(
        first, name="beside", camera_from_world=RigidTransform.from_translation([-0.3, 0, 0]) * first.camera_from_world
    )
    rig = Rig((first, second))
    places = boards(rng, 60)
    views = observe_board(rng, rig, places)
    both = [m for m in range(60) if len(views.detections[0][m].corner) == len(views.detections[1][m].corner) == 30]
    views = views.select_moments(both)
    px = [[s.px.astype(np.float32)[:, None] for s in row] for row in views.detections]
    corners = [views.board.corners.astype(np.float32)] * len(both)
    lenses = [(c.K.copy(), c.distortion.copy()) for c in rig]
    *_, R, t, _, _ = cv2.stereoCalibrate(
        corners, *px, *lenses[0], *lenses[1], first.size, flags=cv2.CALIB_FIX_INTRINSIC
    )
    found = adjust(
        rig,
        [board_source(views, places[both])],
        {"cam0": ALL_FIXED, "beside": FreeParameters(focal=False)},
        loss="squares",
    )
    relative = found.rig.cameras[1].camera_from_world * found.rig.cameras[0].camera_from_world.inv()
    np.testing.assert_allclose(relative.translation, t.ravel(), atol=1e-4)
    assert (relative.rotation * Rotation.from_matrix(R).inv()).magnitude() < 1e-4


def test_one_camera_by_known_points_is_that_of_the_control_points_fit():
    rng = np.random.default_rng(3)
    camera = ring(1, distortion=np.array([-0.1, 0, 0, 0, 0])).cameras[0]
    points = rng.uniform(-1, 1, (40, 3)) + MIDDLE
    source = observe_points(rng, Rig((camera,)), points)
    place = camera.camera_from_world
    start = Pinhole(place.rotation.as_matrix(), camera.centre, camera.K[0, 0], camera.K[:2, 2])
    expected = fit_pinhole(start, PINHOLE_MODELS[-1], points[source.point], source.px)
    found = adjust(Rig((camera,)), [source], FreeParameters(principal_point=True, n_terms=1), loss="squares")
    np.testing.assert_allclose(found.rig.cameras[0].centre, expected.centre, atol=1e-4)
    np.testing.assert_allclose(found.rig.cameras[0].K[:2, 2], expected.principal_point, atol=0.02)
    assert found.rig.cameras[0].distortion[0] == pytest.approx(expected.terms[0], abs=1e-4)
    assert not found.is_gauge_free


def test_errors_lie_within_two_standard_deviations_as_often_as_they_should():
    rig = ring(3, distortion=np.zeros(5))
    inside = total = 0
    for seed in range(25):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-0.8, 0.8, (20, 3)) + MIDDLE
        free = rng.uniform(-0.8, 0.8, (40, 3)) + MIDDLE
        sources = [
            observe_points(rng, rig, points, noise_px=0.5, name="survey"),
            observe_points(rng, rig, free, noise_px=2.0, name="person", is_free=np.ones(40, bool)),
        ]
        found = adjust(rig, sources, FreeParameters())
        centres = np.stack([c.centre for c in found.rig]) - np.stack([c.centre for c in rig])
        focals = np.array([c.K[0, 0] - t.K[0, 0] for c, t in zip(found.rig, rig, strict=True)])
        off = np.abs(np.column_stack([centres, focals]) / found.camera_sd[:, 3:7])
        inside, total = inside + (off < 2).sum(), total + off.size
    share = inside / total  # the numbers of one camera go together: about 100 independent ones
    assert 0.90 < share < 0.99


def moved(camera, step):
    """The camera turned, shifted and zoomed as `Camera.covariance` counts it."""
    turn = RigidTransform.from_components(-step[3:6], Rotation.from_rotvec(step[:3]))
    return replace(
        camera, camera_from_world=turn * camera.camera_from_world, K=camera.K @ np.diag([1 + step[6], 1 + step[6], 1])
    )


@pytest.mark.parametrize("free", [FreeParameters(), FreeParameters(principal_point=True, n_terms=2)])
def test_images_move_as_the_cameras_covariances_say(free):
    rig, statistic = ring(3, distortion=np.zeros(5)), []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-0.8, 0.8, (40, 3)) + MIDDLE
        found = adjust(rig, [observe_points(rng, rig, points, noise_px=0.5)], free)
        for camera, true in zip(found.rig, rig, strict=True):
            px = true.px_from_world(points)
            steps = 1e-6 * np.eye(7)
            J = np.stack([(moved(true, each).px_from_world(points) - px).ravel() for each in steps], axis=1) / 1e-6
            alike = np.linalg.lstsq(J, (camera.px_from_world(points) - px).ravel())[0]
            statistic.append(alike @ np.linalg.solve(camera.covariance, alike))
    inside = np.mean(np.array(statistic) < chi2.ppf(0.95, 7))
    assert 0.85 < inside <= 1
    assert 4 < np.mean(statistic) < 9  # of 7 numbers


def test_each_sources_noise_is_found():
    rng = np.random.default_rng(5)
    rig = ring(4)
    points = rng.uniform(-0.8, 0.8, (150, 3)) + MIDDLE
    sharp = observe_points(rng, rig, points, noise_px=0.2, name="survey")
    blurred = observe_points(rng, rig, points, noise_px=4.0, name="person", is_free=np.ones(150, bool))
    found = adjust(rig, [sharp, blurred], FreeParameters(n_terms=2))
    assert found.noise_px == pytest.approx((0.2, 4.0), rel=0.1)


def test_wrong_places_hardly_matter():
    rng = np.random.default_rng(6)
    rig = ring(4)
    source = board_of(rng, rig, n=60)
    px = source.px.copy()
    wrong = rng.random(len(px)) < 0.08
    px[wrong] += rng.uniform(-60, 60, (wrong.sum(), 2))
    clean = adjust(rig, [source], FreeParameters(n_terms=4))
    found = adjust(rig, [replace(source, px=px)], FreeParameters(n_terms=4))
    assert np.abs(apart(found.rig) - apart(rig)).max() < 2 * np.abs(apart(clean.rig) - apart(rig)).max() + 2e-3
    assert np.median(found.weight[0][wrong]) < 0.02
    squares = adjust(rig, [replace(source, px=px)], FreeParameters(n_terms=4), loss="squares")
    assert np.abs(apart(squares.rig) - apart(rig)).max() > 3 * np.abs(apart(found.rig) - apart(rig)).max()


def test_cameras_that_look_late_are_found_out():
    rng = np.random.default_rng(7)
    rig = ring(3, distortion=np.zeros(5))
    late_s = np.array([0.0, 0.03, -0.03])
    times = np.arange(40) * 0.1

    def places(t):
        turn = np.column_stack([0.3 * np.sin(2 * t), 0.3 * np.cos(1.3 * t), 0.2 * np.sin(t)])
        shift = np.column_stack([0.3 * np.sin(1.5 * t), 0.3 * np.cos(1.2 * t), 1 + 0.1 * np.sin(2 * t)])
        facing = Rotation.from_euler("y", -90, degrees=True)
        return RigidTransform.from_components(shift, facing * Rotation.from_rotvec(turn))

    rig = Rig(tuple(replace(c, camera_from_world=rig.cameras[0].camera_from_world) for c in rig))
    shifted = [RigidTransform.from_translation([0.5 * i, 0, 0]) for i in range(3)]
    rig = Rig(tuple(replace(c, camera_from_world=s * c.camera_from_world) for c, s in zip(rig, shifted, strict=True)))
    views = observe_board(rng, rig, places(times), noise_px=0.2, moving=[places(times + late) for late in late_s])
    source = board_source(views, places(times))
    lags = ObservationLags(group=source.camera * 40 + source.moments, time_s=times, sd_s=0.05)
    exact = adjust(rig, [source], FreeParameters(focal=False))
    loose = adjust(rig, [replace(source, lags=lags)], FreeParameters(focal=False))
    assert exact.rms_px() > 3 * loose.rms_px()
    medians = np.array([np.median(loose.lag_s[0][source.camera == i]) for i in range(3)])
    np.testing.assert_allclose(medians - medians.mean(), late_s, atol=0.004)
    assert np.abs(apart(loose.rig) - apart(rig)).max() < 0.01


def test_cameras_that_share_a_focal_length_get_one():
    rng = np.random.default_rng(8)
    rig = ring(3)
    source = board_of(rng, rig)
    start = shaken(rng, rig)
    found = adjust(start, [source], FreeParameters(shares_focal="all", n_terms=1))
    change = [camera.K[0, 0] - begun.K[0, 0] for camera, begun in zip(found.rig, start, strict=True)]
    assert np.ptp(change) < 1e-9
    held = adjust(start, [source], FreeParameters(focal=False))
    assert all(a.K[0, 0] == b.K[0, 0] for a, b in zip(held.rig, start, strict=True))
    assert not held.camera_sd[:, 6:].any()


def test_the_length_of_a_wand_is_the_scale():
    rng = np.random.default_rng(9)
    rig = ring(4, distortion=np.zeros(5))
    middle = rng.uniform(-0.5, 0.5, (60, 3)) + MIDDLE
    half = 0.3 * Rotation.random(60, rng=rng).apply([1, 0, 0])
    ends = np.concatenate([middle - half, middle + half])
    lengths = Lengths(first=np.arange(60), second=np.arange(60, 120), length_m=np.full(60, 0.6))
    start = 1.2 * ends + rng.normal(0, 0.02, ends.shape)
    source = observe_points(rng, rig, ends, is_free=np.ones(120, bool), start=start)
    grown = Rig(
        tuple(
            replace(
                c,
                camera_from_world=RigidTransform.from_components(
                    1.2 * c.camera_from_world.translation, c.camera_from_world.rotation
                ),
            )
            for c in rig
        )
    )
    found = adjust(grown, [replace(source, lengths=lengths)], FreeParameters())
    np.testing.assert_allclose(apart(found.rig), apart(rig), rtol=0.01)


def test_errors_in_common_make_the_standard_deviations_larger():
    rng = np.random.default_rng(10)
    rig = ring(3, distortion=np.zeros(5))
    points = np.tile(rng.uniform(-0.8, 0.8, (20, 3)) + MIDDLE, (10, 1))
    source = observe_points(rng, rig, points, noise_px=0.1)
    steady = rng.normal(0, 2.0, (20, 3, 2))
    px = source.px + steady[source.point % 20, source.camera]
    cluster = source.point % 20 * 3 + source.camera
    single = adjust(rig, [replace(source, px=px)], FreeParameters())
    clustered = adjust(rig, [replace(source, px=px, cluster=cluster)], FreeParameters())
    ratio = clustered.camera_sd[:, :7] / single.camera_sd[:, :7]
    assert ratio.min() > 0.99
    assert np.median(ratio) > 1.8  # ten looks at the same point are worth one: about 3


def test_what_is_known_beforehand_counts():
    rng = np.random.default_rng(11)
    rig = ring(3)
    source = board_of(rng, rig, n=30)
    start = shaken(rng, rig, shift_m=0.0, turn_rad=0.0, focal_px=30.0)
    sd = np.full((3, 18), np.inf)
    sd[:, 6] = 1e-3
    held = adjust(start, [source], FreeParameters(n_terms=2), prior=CameraPrior(sd=sd))
    np.testing.assert_allclose([c.K[0, 0] for c in held.rig], [c.K[0, 0] for c in start], atol=0.05)


def test_moving_the_world_changes_no_pixel():
    rng = np.random.default_rng(12)
    rig = ring(3)
    found = adjust(rig, [board_of(rng, rig, n=30)], FreeParameters(n_terms=2))
    move = RigidTransform.from_components([1.0, 2.0, 3.0], Rotation.from_rotvec([0.3, -0.2, 0.9]))
    moved_rig, moved = found.transform(move)
    again = adjust(moved_rig, moved, ALL_FIXED)
    np.testing.assert_allclose(again.residual_px[0], found.residual_px[0], atol=5e-3)
    np.testing.assert_allclose(moved_rig.cameras[0].centre, move.apply(found.rig.cameras[0].centre), atol=1e-12)


def test_nothing_seen_is_refused():
    rig = ring(3)
    alone = observe_points(
        np.random.default_rng(0), Rig(rig.cameras[:1]), np.array([[0, 0, 1.0]]), is_free=np.ones(1, bool)
    )
    with pytest.raises(CalibrationError, match="no point is seen by enough cameras"):
        adjust(rig, [alone])
    with pytest.raises(CalibrationError, match="camera 'cam1'"):
        adjust(rig, [observe_points(np.random.default_rng(0), rig, np.zeros((5, 3)))], {"cam0": FreeParameters()})
