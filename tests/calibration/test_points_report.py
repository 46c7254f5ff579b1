import json
from dataclasses import replace

import pytest

from airborne.calibration.from_points import calibrate
from airborne.calibration.points_report import describe_points_calibration, points_calibration_to_dict
from airborne.cameras.finding import Finding
from tests.support.cameras import restrict_to_cameras


def test_the_table_has_a_row_for_every_camera_with_its_errors(calibration):
    lines = describe_points_calibration(calibration).splitlines()
    assert lines[0].split("  ")[0] == "camera"
    for line, fit in zip(lines[1:4], calibration.fits, strict=True):
        assert line.startswith(fit.name)
        assert f"{fit.rms_px:.2f}" in line
        assert f"{fit.held_out_m * 1e3:.2f}" in line
        assert line.endswith("  7 parameters")
    assert f"held-out control points in 3D: {calibration.held_out_3d_m * 1e3:.1f} mm RMS" in lines


def test_the_table_says_why_a_model_was_chosen(calibration):
    lines = describe_points_calibration(calibration).splitlines()
    (reason,) = [line for line in lines if "not clearly worse" in line]
    assert reason.startswith("model: the simplest of ") and max(map(len, lines)) <= 120


def test_warnings_stand_at_the_end(calibration):
    doubtful = replace(calibration, findings=(Finding(kind="odd", what="something is odd", advice="look"),))
    assert describe_points_calibration(doubtful).splitlines()[-1] == "warning: something is odd: look"
    assert "warning" not in describe_points_calibration(calibration)


def test_the_dictionary_survives_json_and_holds_what_the_table_says(calibration):
    data = json.loads(json.dumps(points_calibration_to_dict(calibration), allow_nan=False))
    assert data["method"] == "lm"
    assert data["held_out_3d_rms_mm"] == pytest.approx(calibration.held_out_3d_m * 1e3)
    for fit in calibration.fits:
        assert data["cameras"][fit.name]["rms_px"] == pytest.approx(fit.rms_px)
        assert len(data["cameras"][fit.name]["dlt_coefficients"]) == 11
        assert set(data["cameras"][fit.name]["sd"]) == set(fit.sd)


def test_height_angle_is_what_the_image_spans(calibration):
    angle = points_calibration_to_dict(calibration)["cameras"]["cam3"]["height_angle_deg"]
    assert angle == pytest.approx(30.5, abs=0.1)  # 576 rows at 1055 px


def test_one_camera_has_no_error_in_space(points, sizes):
    alone = calibrate(restrict_to_cameras(points, "cam1"), sizes, method="annealing")
    assert points_calibration_to_dict(alone)["held_out_3d_rms_mm"] is None
    assert "in 3D" not in describe_points_calibration(alone)
