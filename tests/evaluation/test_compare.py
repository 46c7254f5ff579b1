"""Comparing a motion with the truth."""

import json
from dataclasses import replace

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.evaluation import compare_motion
from tests.support.evaluation import HALF_TURN, IDENTITY, flight, motion_of, shifted, turned
from tests.support.tolerances import ROUNDTRIP, sampled


def rows(truth, keep):
    """Keep some rows of a truth or a motion."""
    every = {name: getattr(truth, name) for name in truth.__dataclass_fields__}
    return replace(truth, **{name: each[keep] for name, each in every.items() if isinstance(each, np.ndarray)})


def test_truth_has_no_error_against_itself():
    result = compare_motion(motion_of(flight()), flight(), IDENTITY)
    assert (result.n_frames, result.n_truth, result.n_matched, result.n_tracked) == (40, 40, 40, 40)
    assert result.position.largest_3d_mm == pytest.approx(0, abs=ROUNDTRIP)
    assert result.raw.geodesic_largest_deg == pytest.approx(0, abs=ROUNDTRIP)
    assert max(result.raw.largest_deg) == pytest.approx(0, abs=ROUNDTRIP)


def test_constant_shift_is_the_error_of_its_axis_in_millimetres():
    result = compare_motion(shifted(motion_of(flight()), [0.003, 0, -0.004]), flight(), IDENTITY)
    np.testing.assert_allclose(result.position.rms_mm, [3, 0, 4], atol=ROUNDTRIP)
    np.testing.assert_allclose(result.position.largest_mm, [3, 0, 4], atol=ROUNDTRIP)
    assert result.position.rms_3d_mm == pytest.approx(5)


def test_one_bad_frame_is_the_largest_error_and_its_share_of_the_rms():
    bad = np.zeros((40, 3))
    bad[7, 1] = 0.040
    result = compare_motion(shifted(motion_of(flight()), bad), flight(), IDENTITY)
    assert result.position.largest_mm[1] == pytest.approx(40)
    assert result.position.rms_mm[1] == pytest.approx(40 / np.sqrt(40))


def test_rotation_about_the_somersault_axis_is_a_somersault_error_only():
    result = compare_motion(turned(motion_of(flight()), np.tile([np.deg2rad(2), 0, 0], (40, 1))), flight(), IDENTITY)
    np.testing.assert_allclose(result.raw.rms_deg, [2, 0, 0], atol=ROUNDTRIP)
    assert result.raw.geodesic_rms_deg == pytest.approx(2)


def test_angle_errors_do_not_jump_where_the_angles_wrap():
    offset = np.tile([np.deg2rad(12), 0, 0], (40, 1))  # over one frame's turn: one frame straddles 180 degrees
    result = compare_motion(turned(motion_of(flight()), offset), flight(), IDENTITY)
    np.testing.assert_allclose(result.raw.largest_deg, [12, 0, 0], atol=ROUNDTRIP)


def test_whole_run_flipped_is_wrong_raw_and_right_modulo_symmetry():
    motion = motion_of(flight())
    result = compare_motion(replace(motion, R=motion.R @ HALF_TURN[1]), flight(), HALF_TURN)
    assert result.raw.geodesic_rms_deg == pytest.approx(180)
    assert "turned to another pose that looks the same: see modulo symmetry" in result.describe()
    assert result.modulo_run.geodesic_rms_deg == pytest.approx(0, abs=ROUNDTRIP)
    assert result.modulo_frame.geodesic_rms_deg == pytest.approx(0, abs=ROUNDTRIP)
    assert result.n_flips == 0


def test_flip_within_the_run_is_forgiven_by_frame_only_and_counted():
    motion = motion_of(flight())
    R = motion.R.copy()
    R[30:] = R[30:] @ HALF_TURN[1]
    result = compare_motion(replace(motion, R=R), flight(), HALF_TURN)
    assert result.n_flips == 1
    assert result.modulo_frame.geodesic_largest_deg == pytest.approx(0, abs=ROUNDTRIP)
    assert result.modulo_run.geodesic_rms_deg == pytest.approx(180 * np.sqrt(10 / 40))
    assert result.raw.geodesic_largest_deg == pytest.approx(180)


def test_lost_frames_count_and_carry_no_error():
    result = compare_motion(motion_of(flight(), lost=[3, 4], uncertain=[5]), flight(), IDENTITY)
    assert (result.n_matched, result.n_tracked, result.n_uncertain, result.n_lost) == (40, 37, 1, 2)
    assert result.position.largest_3d_mm == pytest.approx(0, abs=ROUNDTRIP)


def test_frames_are_matched_by_time_not_by_number():
    truth = rows(flight(), slice(5, 25))
    motion = replace(motion_of(truth), index=np.arange(20), time_s=truth.time_s + 0.0015)
    result = compare_motion(motion, truth, IDENTITY)
    assert result.n_matched == 20
    assert result.largest_time_offset_s == pytest.approx(0.0015)


def test_field_between_two_frames_of_the_truth_is_left_out():
    result = compare_motion(motion_of(flight()), rows(flight(), slice(None, None, 2)), IDENTITY)
    assert (result.n_frames, result.n_truth, result.n_matched) == (40, 20, 20)
    assert result.position.largest_3d_mm == pytest.approx(0, abs=ROUNDTRIP)


@pytest.mark.parametrize("n_motion", [1, 40])
def test_one_true_frame_can_be_compared(n_motion):
    truth = rows(flight(), slice(0, 1))
    result = compare_motion(rows(motion_of(flight()), slice(0, n_motion)), truth, IDENTITY)
    assert (result.n_matched, result.raw.geodesic_rms_deg) == (1, pytest.approx(0, abs=ROUNDTRIP))


def test_truth_of_another_time_is_refused():
    late = replace(flight(), time_s=flight().time_s + 60)
    with pytest.raises(ResultError, match=r"no pose to compare: motion 0\.000 to 0\.780 s .* truth 60\.000 to 60\.780"):
        compare_motion(motion_of(flight()), late, IDENTITY)


def test_motion_lost_throughout_or_empty_is_refused():
    with pytest.raises(ResultError, match="with 0 poses"):
        compare_motion(motion_of(flight(), lost=range(40)), flight(), IDENTITY)
    with pytest.raises(ResultError, match="motion empty"):
        compare_motion(rows(motion_of(flight()), slice(0, 0)), flight(), IDENTITY)


def test_correct_deviations_contain_the_normal_share_of_the_errors():
    n, rng = 3000, np.random.default_rng(5)
    truth = flight(n)
    sd = np.array([1e-3, 2e-3, 3e-3, 0.01, 0.02, 0.005])
    noise = rng.normal(size=(n, 6)) * sd
    motion = turned(shifted(motion_of(truth, covariance=np.diag(sd**2)), noise[:, :3]), noise[:, 3:])
    result = compare_motion(motion, truth, IDENTITY)
    for share in (result.position_calibration, result.rotation_calibration):
        assert share.n == 3 * n
        assert share.within_1sd == pytest.approx(0.6827, abs=sampled(3 * n))
        assert share.within_2sd == pytest.approx(0.9545, abs=sampled(3 * n))


def test_deviations_that_are_infinite_or_unknown_are_not_counted():
    covariance = np.diag([1e-6, 1e-6, np.inf, 1e-4, np.nan, 1e-4])
    result = compare_motion(motion_of(flight(), covariance=covariance), flight(), IDENTITY)
    assert (result.position_calibration.n, result.rotation_calibration.n) == (80, 80)


def test_rotation_errors_are_judged_modulo_symmetry():
    motion = motion_of(flight(), covariance=np.eye(6) * 1e-6)
    result = compare_motion(replace(motion, R=motion.R @ HALF_TURN[1]), flight(), HALF_TURN)
    assert result.rotation_calibration.within_1sd == 1


def test_frames_near_the_singularity_are_counted():
    truth = flight(3)
    R = truth.R.copy()
    R[1] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # 90 degrees of tilt
    truth = replace(truth, R=R)
    assert compare_motion(motion_of(truth), truth, IDENTITY).n_singular == 1


def test_numbers_go_to_json_with_unknown_as_null():
    result = compare_motion(motion_of(flight()), flight(), HALF_TURN)
    numbers = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert numbers["position_calibration"] == {"within_1sd": None, "within_2sd": None, "n": 0}
    assert numbers["position"]["rms_mm"][0] == result.position.rms_mm[0]


def test_description_names_every_axis_and_symmetry_only_where_there_is_one():
    motion = motion_of(flight(), covariance=np.eye(6) * 1e-6)
    plain = compare_motion(motion, flight(), IDENTITY).describe()
    assert all(name in plain for name in ("x ", "y ", "z ", "somersault", "tilt", "twist", "RMS", "mm", "deg", "1 sd"))
    assert "symmetry" not in plain
    assert "symmetry" in compare_motion(motion, flight(), HALF_TURN).describe()


def test_of_rotations_that_are_transposed_it_is_asked():
    true = flight()
    known = motion_of(true, covariance=np.diag(np.full(6, 1e-6)))
    asked = compare_motion(known, replace(true, R=np.swapaxes(true.R, 1, 2)), IDENTITY).describe()
    assert "hardly any rotation lies within 2 sd" in asked and "transposed" in asked
    assert "hardly any position" not in asked
    assert "hardly any" not in compare_motion(known, true, IDENTITY).describe()


def test_a_reference_in_millimetres_is_asked_about_in_columns_that_stay_apart():
    true = flight()
    text = compare_motion(motion_of(true), replace(true, position=1e3 * true.position), IDENTITY).describe()
    assert "are its numbers millimetres that are read as metres?" in text
    row = next(line for line in text.splitlines() if line.startswith("  in space"))
    assert len(row.split()) == 4
    assert "millimetres" not in compare_motion(motion_of(true), true, IDENTITY).describe()


def test_a_far_reference_that_dividing_does_not_explain_is_asked_about_too():
    true = flight()
    text = compare_motion(motion_of(true), replace(true, position=1e3 * true.position + 1e3), IDENTITY).describe()
    assert "is it in millimetres?" in text


def test_a_reference_with_exchanged_axes_is_asked_about_and_nothing_else():
    true = flight()
    known = motion_of(true, covariance=np.diag(np.full(6, 1e-6)))
    other = replace(true, position=true.position[:, [1, 0, 2]], R=true.R[:, [1, 0, 2]] * [1, 1, -1])
    text = compare_motion(known, other, IDENTITY).describe()
    assert "with its y, x, z taken as x, y, z the reference would lie 0 mm from the run" in text
    assert text.count("?") == 1 and "TRC" not in text


@pytest.mark.parametrize("first_s", [0.0, 0.2])
def test_a_reference_whose_times_are_twice_as_long_is_asked_about_its_rate(first_s):
    true = flight()
    known = replace(motion_of(true, covariance=np.diag(np.full(6, 1e-6))), time_s=true.time_s + first_s)
    text = compare_motion(known, replace(true, time_s=first_s + 2 * true.time_s), IDENTITY).describe()
    assert "with its times multiplied by 0.5 " in text and "is its rate 50 times a second, not 25?" in text
    assert text.count("?") == 1


def test_a_reference_of_which_few_times_match_is_asked_about_them():
    true = flight()
    other = replace(true, time_s=1.13 * true.time_s, position=true.position[::-1])
    text = compare_motion(motion_of(true), other, IDENTITY).describe()
    assert "times match that could: its times are 22.6 ms apart, the run's 20 ms" in text and text.count("?") == 1


def test_of_another_recording_no_rotation_is_called_transposed():
    true = flight()
    known = motion_of(true, covariance=np.diag(np.full(6, 1e-6)))
    text = compare_motion(known, replace(true, R=true.R[::-1], position=true.position[::-1]), IDENTITY).describe()
    assert "transposed" not in text and "hardly any rotation lies within 2 sd: is this the reference of this" in text


@pytest.mark.parametrize("error_m", [0.0, 0.005, [0.5, 0, 0.2]])
def test_of_a_right_reference_nothing_is_asked_however_far_the_run_is(error_m):
    text = compare_motion(shifted(motion_of(flight()), error_m), flight(), IDENTITY).describe()
    assert "?" not in text


def test_a_truth_whose_clock_is_off_by_a_frame_is_reported():
    true = flight()
    period_s = float(np.diff(true.time_s)[0])
    result = compare_motion(motion_of(true), replace(true, time_s=true.time_s + 2 * period_s), IDENTITY)
    assert result.better_shift_s == pytest.approx(-2 * period_s, abs=ROUNDTRIP)
    assert result.better_rms_3d_mm == pytest.approx(0, abs=1e3 * ROUNDTRIP)
    assert f"{-2e3 * period_s:.1f} ms added" in result.describe()


def test_a_constant_error_is_no_shift_of_the_clock():
    result = compare_motion(shifted(motion_of(flight()), [0.003, 0, -0.004]), flight(), IDENTITY)
    assert result.better_shift_s == 0 and result.better_rms_3d_mm == pytest.approx(5)


@pytest.mark.parametrize("later_s", [0.0, 0.1])
def test_times_in_milliseconds_are_asked_about(later_s):
    true = flight()
    motion = replace(motion_of(true), time_s=true.time_s + later_s)
    with pytest.raises(ResultError, match=r"are they in milliseconds\? .* divide it by 1000"):
        compare_motion(motion, replace(true, time_s=1e3 * motion.time_s), IDENTITY)
