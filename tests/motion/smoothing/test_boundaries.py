"""Levels passed and highest places are found between the frames."""

import numpy as np
import pytest

from airborne.motion.smoothing import crossings, parabolic_peak
from tests.support.tolerances import ROUNDTRIP

T = np.arange(50) / 50


def test_a_line_passes_its_level_between_frames():
    assert crossings(T, 2 * T, 0.731) == pytest.approx([0.3655], abs=ROUNDTRIP)
    assert len(crossings(T, 2 * T, 0.731, rising=False)) == 0


def test_a_wave_passes_up_and_down_in_turn():
    wave = np.sin(2 * np.pi * 2 * T - 0.3)
    up, down = crossings(T, wave, 0.0), crossings(T, wave, 0.0, rising=False)
    assert len(up) == len(down) == 2
    assert np.sort(np.concatenate([up, down])) == pytest.approx((np.arange(4) * np.pi + 0.3) / (4 * np.pi), abs=1e-3)


def test_nothing_is_passed_across_an_unknown_frame():
    path = np.where(T < 0.5, -1.0, 1.0)
    path[25] = np.nan
    assert len(crossings(T, path, 0.0)) == 0


def test_the_top_of_a_parabola_is_exact_between_frames():
    assert parabolic_peak(T, 2 - 9.81 / 2 * (T - 0.4567) ** 2) == pytest.approx((0.4567, 2.0), abs=ROUNDTRIP)


def test_at_an_end_or_beside_a_gap_the_frame_itself_counts():
    assert parabolic_peak(T, T) == (0.98, 0.98)
    path = -((T - 0.5) ** 2)
    path[26] = np.nan
    assert parabolic_peak(T, path) == (0.5, 0.0)
    assert np.isnan(parabolic_peak(T, np.full(50, np.nan))).all()
