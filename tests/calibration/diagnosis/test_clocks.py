"""Time stamps and counters that roll over, repeat or skip; rows read one by one."""

import numpy as np
import pytest

from airborne.calibration.diagnosis.clocks import check_counter, check_image_counts, check_rolling_shutter, check_times

TIMES_S = np.arange(200) / 50 + np.random.default_rng(0).normal(0, 5e-4, 200)


def test_a_clock_that_runs_on_is_not_flagged():
    assert check_times("cam1", TIMES_S) == []
    assert check_counter("cam1", np.arange(7, 300)) == []
    assert check_times("cam1", TIMES_S[:3]) == []


@pytest.mark.parametrize("modulus", [256, 65536, 1000])
def test_a_counter_that_rolls_over_is_reported(modulus):
    counts = np.arange(modulus - 60, modulus + 40) % modulus
    [found] = check_counter("cam1", counts)
    assert f"image numbers fall from {modulus - 1:g} to 0 after image 59" in found.sentence


def test_a_clock_that_starts_anew_is_reported():
    times_s = TIMES_S.copy()
    times_s[120:] -= times_s[120]
    [found] = check_times("cam1", times_s)
    assert "time stamps fall from 2.38" in found.sentence
    assert "to 0 after image 119" in found.sentence


def test_images_stored_twice_are_reported():
    times_s = np.insert(TIMES_S, [50, 90], TIMES_S[[50, 90]])
    [found] = check_times("cam1", times_s)
    assert "time stamps stand still after images 50, 91" in found.sentence


def test_lost_images_are_counted():
    [found] = check_times("cam1", np.delete(TIMES_S, [30, 31, 32, 100]))
    assert found.sentence.startswith("cam1: 4 images are missing by its time stamps, after images 29, 96")
    [found] = check_counter("cam1", np.delete(np.arange(100), [40]))
    assert "1 image is missing by its image numbers, after image 39" in found.sentence


def test_many_places_are_not_all_listed():
    [found] = check_times("cam1", np.delete(TIMES_S, np.arange(10, 190, 20)))
    assert "and 6 more" in found.sentence


def test_stamps_that_are_no_times_are_reported():
    assert "never go forward" in check_times("cam1", np.zeros(20))[0].sentence


def test_the_camera_with_another_number_of_images_is_named():
    assert check_image_counts({"cam1": 100, "cam2": 100}) == []
    assert check_image_counts({"cam1": 100, "cam2": 99}, 2) == []
    [found] = check_image_counts({"cam1": 100, "cam2": 100, "cam3": 95})
    assert found.sentence.startswith("cam3 has 95 images, cam1 and cam2 100: ")


def rows_read_late(readout_s, *, offset_s=0.0, n=400):
    """Residuals of moving points in a camera that reads its rows one by one."""
    rng = np.random.default_rng(1)
    velocity, row = rng.normal(0, 200, (n, 2)), rng.uniform(0, 1080, n)
    late_s = offset_s + readout_s * (row / 1080 - 0.5)
    return late_s[:, None] * velocity + rng.normal(0, 0.5, (n, 2)), velocity, row


def test_rows_read_one_by_one_are_reported_with_their_time():
    residual, velocity, row = rows_read_late(0.020, offset_s=0.004)
    residual[::17] += 30
    [found] = check_rolling_shutter("cam1", residual, velocity, row_px=row, height_px=1080)
    assert float(found.sentence.split("over ")[1].split(" ms")[0]) == pytest.approx(20, abs=2)


def test_a_shutter_that_opens_at_once_is_not_flagged():
    residual, velocity, row = rows_read_late(0.0, offset_s=0.004)
    assert check_rolling_shutter("cam1", residual, velocity, row_px=row, height_px=1080) == []
    residual, velocity, row = rows_read_late(0.02)
    assert check_rolling_shutter("cam1", residual, 0 * velocity, row_px=row, height_px=1080) == []
    assert check_rolling_shutter("cam1", residual * np.nan, velocity, row_px=row, height_px=1080) == []
