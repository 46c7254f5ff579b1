"""Rising and falling are detected from the torso's last heights."""

import numpy as np
import pytest

from airborne.tracking.particle.jump_state import share_above, vertical_speed

TIMES_S = np.arange(7) / 60


@pytest.mark.parametrize("speed_m_s, share", [(3.0, 0.75), (-3.0, 0.25), (0.3, 0.5), (-0.3, 0.5), (0.0, 0.5)])
def test_a_steady_speed_is_found_and_sets_the_share_above(speed_m_s, share):
    speed = vertical_speed(TIMES_S, 1 + speed_m_s * TIMES_S)
    assert speed == pytest.approx(speed_m_s, abs=1e-9)
    assert share_above(speed) == share


def test_only_the_last_seven_frames_count():
    heights = np.r_[np.linspace(0, 9, 20), np.full(7, 1.0)]
    assert vertical_speed(np.arange(27) / 60, heights) == pytest.approx(0, abs=1e-9)


def test_two_centimetres_of_noise_give_a_quarter_of_a_metre_a_second():
    rng = np.random.default_rng(0)
    speed = [vertical_speed(TIMES_S, rng.normal(1, 0.02, 7)) for _ in range(4000)]
    assert np.std(speed) == pytest.approx(0.23, abs=0.01)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_short_a_past_says_ground(n):
    assert share_above(vertical_speed(TIMES_S[:n], 5 * TIMES_S[:n])) == 0.5
