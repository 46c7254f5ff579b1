import numpy as np
import pytest

from airborne.calibration.from_points import calibrate
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import read_rig
from airborne.errors import CalibrationError
from tests.support.cameras import restrict_to_cameras
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED


@pytest.fixture(scope="module")
def annealed(points, sizes):
    return calibrate(points, sizes, method="annealing")


def test_the_points_are_fitted_as_well_as_they_were_clicked(calibration):
    """Clicks of 0.5 px a coordinate miss by 0.7 px; without noise in the survey nothing more is left."""
    for fit in calibration.fits:
        assert 0.5 < fit.rms_px < 0.75
        assert fit.dlt_rms_px < fit.rms_px < fit.held_out_rms_px[fit.model]
    assert calibration.warnings == ()


def test_held_out_points_come_out_within_five_millimetres(calibration):
    assert calibration.held_out_points_m.shape == (24, 3)
    assert 0.001 < calibration.held_out_3d_m < 0.005


def test_the_volume_of_flight_is_measured_within_three_millimetres(calibration, thrown_cross):
    truth = read_rig(thrown_cross / "calib_true.toml")
    grid = np.stack(np.meshgrid(np.linspace(-0.7, 0.7, 5), [-0.3, 0, 0.3], np.linspace(0.9, 2.1, 5)), -1).reshape(-1, 3)
    px = np.stack([camera.px_from_world(grid) for camera in truth], axis=1)
    assert np.linalg.norm(calibration.rig.points_from_px(px) - grid, axis=1).max() < 0.003


def test_annealing_agrees_with_least_squares_on_seven_parameters(calibration, annealed):
    for ours, theirs, fit in zip(calibration.rig, annealed.rig, calibration.fits, strict=True):
        assert fit.model == "7 parameters"
        assert np.allclose(ours.centre, theirs.centre, atol=SOLVED)
        assert theirs.K[0, 0] == pytest.approx(ours.K[0, 0], rel=SOLVED)
        assert np.allclose(ours.K[:2, 2], [383.5, 287.5], atol=EXACT)


def test_the_same_seed_gives_the_same_camera(points, sizes, annealed):
    again = calibrate(restrict_to_cameras(points, "cam3"), sizes, method="annealing")
    assert np.array_equal(again.rig["cam3"].P, annealed.rig["cam3"].P)


def test_one_camera_alone_is_calibrated_the_same_but_measures_nothing(points, sizes, calibration):
    alone = calibrate(restrict_to_cameras(points, "cam2"), sizes)
    assert np.allclose(alone.rig["cam2"].P, calibration.rig["cam2"].P, rtol=ROUNDTRIP)
    assert np.isnan(alone.held_out_3d_m)


def test_residuals_stand_at_their_points(points, calibration):
    for i, (camera, fit) in enumerate(zip(calibration.rig, calibration.fits, strict=True)):
        assert np.allclose(fit.residual_px, points.px[:, i] - camera.px_from_world(points.world), equal_nan=True)
        assert np.array_equal(np.isnan(fit.m_per_px), ~points.is_seen_by(fit.name))
        assert fit.rms_m == pytest.approx(fit.rms_px * np.nanmean(fit.m_per_px), rel=0.1)


def test_true_focal_lengths_lie_within_three_standard_deviations(calibration, thrown_cross):
    truth = read_rig(thrown_cross / "calib_true.toml")
    for camera, fit in zip(calibration.rig, calibration.fits, strict=True):
        assert abs(camera.K[0, 0] - truth[fit.name].K[0, 0]) < 3 * fit.sd["focal_px"]
        offset = np.abs(camera.centre - truth[fit.name].centre)
        assert np.all(offset < 3 * np.array([fit.sd[axis] for axis in ("x_m", "y_m", "z_m")]))


def test_points_that_nobody_sees_are_no_trouble(shared_data):
    points = read_control_points(shared_data("block_jump") / "control_points.csv")
    calibration = calibrate(points, dict.fromkeys(points.cameras, (1920, 1080)))
    assert calibration.held_out_3d_m < 0.02
    assert calibration.warnings == ()
    assert np.isnan(calibration.held_out_points_m[points.names.index("near_corner_L")]).all()


def test_an_unknown_method_is_reported(points, sizes):
    with pytest.raises(CalibrationError, match="'genetic'; expected 'lm' or 'annealing'"):
        calibrate(points, sizes, method="genetic")  # type: ignore[arg-type]
