"""Which mix-ups foregrounds and silhouettes show, and which they must not show."""

import numpy as np
import pytest

from airborne.run.mix_ups import MixUp, mix_ups_in, possible_mix_ups

NAMES = ("left", "middle", "right")


def disc(u, v, radius=12, size=(120, 160)):
    rows, columns = np.indices(size)
    return (rows - v) ** 2 + (columns - u) ** 2 < radius**2


SILHOUETTES = [disc(30, 40), disc(110, 60), disc(60, 95)]
RNG = np.random.default_rng(0)
IMAGES = [each & (RNG.random(each.shape) < 0.8) | (RNG.random(each.shape) < 0.02) for each in SILHOUETTES]


def kinds(images, silhouettes=SILHOUETTES):
    return [(finding.kind, finding.cameras) for finding in mix_ups_in(NAMES, images, silhouettes)]


def test_videos_of_their_own_cameras_show_nothing():
    assert kinds(IMAGES) == []


@pytest.mark.parametrize(("a", "b"), [(0, 1), (0, 2), (1, 2)])
def test_two_exchanged_videos_are_named(a, b):
    images = list(IMAGES)
    images[a], images[b] = images[b], images[a]
    assert kinds(images) == [("swapped", (NAMES[a], NAMES[b]))]


@pytest.mark.parametrize("cameras", [(0, 1, 2), (2, 1, 0)])
def test_three_videos_in_a_wrong_order_are_named_with_the_right_one(cameras):
    images = list(IMAGES)
    for camera, source in MixUp(cameras).order:
        images[source] = IMAGES[camera]
    (finding,) = mix_ups_in(NAMES, images, SILHOUETTES)
    assert (finding.kind, set(finding.cameras)) == ("swapped", set(NAMES))
    right = {source: camera for camera, source in MixUp(cameras).order}
    for name, camera in zip(NAMES, map(right.get, range(3)), strict=True):
        assert f"{name} as {NAMES[camera]}" in finding.sentence


@pytest.mark.parametrize(("n", "n_orders"), [(2, 1), (3, 3 + 2), (4, 6 + 2 * 4 + 2), (8, 28 + 2)])
def test_orders_that_are_tried_stay_few_with_many_cameras(n, n_orders):
    orders = {tuple(mix_up.undo_in(range(n))) for mix_up in possible_mix_ups(n) if mix_up.is_exchange}
    assert len(orders) == n_orders
    assert tuple(range(n)) not in orders


@pytest.mark.parametrize("i", [0, 1, 2])
def test_a_mirrored_video_is_named(i):
    images = list(IMAGES)
    images[i] = images[i][:, ::-1]
    assert kinds(images) == [("mirrored", (NAMES[i],))]


@pytest.mark.parametrize("i", [0, 1, 2])
def test_a_video_upside_down_is_named(i):
    images = list(IMAGES)
    images[i] = images[i][::-1, ::-1]
    assert kinds(images) == [("turned", (NAMES[i],))]


def test_where_little_can_be_seen_nothing_is_said():
    still = np.zeros_like(IMAGES[0])
    assert kinds([still, still, still]) == []
    assert kinds([None, IMAGES[0], IMAGES[2]]) == []
    everywhere = RNG.random(still.shape) < 0.9
    assert kinds([everywhere, everywhere, everywhere]) == []
    assert kinds([disc(80, 60), disc(80, 60), disc(80, 60)], [disc(79.5, 60), disc(84, 60), disc(74, 60)]) == []


def test_a_start_in_a_wrong_place_is_no_mix_up():
    """One camera agrees once its images are mirrored, by chance; the others agree with nothing, either way."""
    misplaced = [disc(80, 100), disc(20, 20), disc(160 - 1 - 60, 95)]
    assert kinds(IMAGES, misplaced) == []
    two_right = [SILHOUETTES[0], SILHOUETTES[1], disc(160 - 1 - 60, 95)]
    assert kinds(IMAGES, two_right) == [("mirrored", (NAMES[2],))]
