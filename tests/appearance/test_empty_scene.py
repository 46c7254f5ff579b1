"""The empty scene: the median of what a static camera shows, and what stands out from it."""

import numpy as np

from airborne.appearance.empty_scene import difference, estimate_empty_scene

WALL = np.random.default_rng(3).uniform(60, 180, (40, 60, 3))


def picture(number, *, noise_grey=2.0):
    """The wall, with a red square that has moved on by 4 pixels."""
    rgb = WALL + np.random.default_rng(number).normal(0, noise_grey, WALL.shape)
    rgb[10:20, 5 + 4 * number : 15 + 4 * number] = (220, 30, 30)
    return np.clip(np.rint(rgb), 0, 255).astype(np.uint8)


PICTURES = [picture(number) for number in range(11)]


def test_what_moves_is_not_in_the_median():
    assert np.abs(estimate_empty_scene(PICTURES).rgb - WALL).max() < 5 * 2.0


def test_what_moves_stands_out_and_noise_does_not():
    nats = estimate_empty_scene(PICTURES).evidence(PICTURES[0])
    assert nats[12:18, 7:13].min() > 2.9
    nats[8:22, 3:17] = -3
    assert np.mean(nats > 0) < 0.002


def test_a_shadow_does_not_stand_out():
    shaded = PICTURES[0].copy()
    shaded[25:35, 30:50] = np.rint(0.6 * WALL[25:35, 30:50])
    nats = estimate_empty_scene(PICTURES).evidence(shaded)
    assert np.mean(nats[27:33, 32:48] > 0) < 0.01
    assert difference(np.rint(0.6 * WALL).astype(np.uint8), WALL.astype(np.float32)).max() < 1.5


def test_a_flickering_pixel_needs_more_to_stand_out():
    flicker = [each.copy() for each in PICTURES]
    for number, each in enumerate(flicker):
        waving = np.random.default_rng(100 + number).normal(0, 25, (10, 20, 3))
        each[30:40, 40:60] = np.clip(WALL[30:40, 40:60] + waving, 0, 255)
    scene = estimate_empty_scene(flicker)
    assert scene.sd[32:38, 44:56].min() > 3 * scene.sd[5, 50]
    assert scene.evidence(flicker[0])[32:38, 44:56].max() < 0
