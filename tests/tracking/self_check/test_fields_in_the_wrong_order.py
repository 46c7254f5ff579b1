"""Fields that are read in the wrong order: the body goes forth and back, and no frame can be relied on."""

import numpy as np
import pytest

from airborne.tracking.self_check.absolute import zigzags

RATE_HZ, SD_M = 50.0, 0.003


def throw(order, *, n=34, speed=3.0, seed=0):
    """Frames of a throw, where the body is found, and the covariance of that; `order` exchanges fields in time."""
    index = np.arange(n)
    t = order(index) / RATE_HZ
    position = t[:, None] * [speed, 0.2 * speed, 0] + t[:, None] * (speed - 4.9 * t[:, None]) * [0, 0, 1]
    noise = SD_M * np.random.default_rng(seed).standard_normal((n, 3))
    return index, position + noise, np.tile(SD_M**2 * np.eye(3), (n, 1, 1))


def exchanged(index):
    return index + np.where(index % 2, -1, 1)


@pytest.mark.parametrize("seed", range(10))
def test_exchanged_fields_zigzag_and_others_do_not(seed):
    assert zigzags(*throw(exchanged, seed=seed))
    assert not zigzags(*throw(lambda index: index, seed=seed))


def test_a_body_at_rest_or_seen_in_every_second_field_tells_nothing():
    index, position, covariance = throw(exchanged)
    rests = SD_M * np.random.default_rng(1).standard_normal(position.shape)
    assert not zigzags(index, rests, covariance)
    assert not zigzags(index[::2], position[::2], covariance[::2])
    assert not zigzags(index[:8], position[:8], covariance[:8])
