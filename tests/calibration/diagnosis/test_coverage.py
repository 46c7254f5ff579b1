"""Too few views, views in one place, boards that never tilt, cameras that share nothing."""

import numpy as np
import pytest

from airborne.calibration.diagnosis.coverage import check_coverage, check_links, check_tilts, check_view_count

NAMES = ("cam1", "cam2", "cam3", "cam4")
SIZE = (1920, 1080)


def test_few_views_are_counted():
    assert check_view_count("cam1", 8) == []
    assert check_view_count("cam1", 1)[0].sentence.startswith(
        "cam1 shows the board in 1 image, expected 8: film it longer"
    )


def test_points_all_over_the_image_are_enough():
    px = np.random.default_rng(0).uniform((0, 0), SIZE, (200, 2))
    assert check_coverage("cam1", px, SIZE) == []


@pytest.mark.parametrize(
    ("low", "high", "where"),
    [
        ((0, 0), (300, 1080), "right part"),
        ((1000, 600), (1400, 1080), "left and upper parts"),
        ((800, 400), (1100, 700), "near its borders"),
    ],
)
def test_where_points_are_missing_is_named(low, high, where):
    px = np.random.default_rng(0).uniform(low, high, (200, 2))
    [found] = check_coverage("cam1", px, SIZE)
    assert where in found.sentence
    assert "% of its image" in found.sentence


def test_a_few_clicks_are_not_blamed_for_leaving_the_image_empty():
    assert check_coverage("cam1", np.full((20, 2), 500.0), SIZE) == []
    assert check_coverage("cam1", np.full((200, 2), np.nan), SIZE) == []


def test_a_board_that_always_faces_the_camera_is_reported():
    rng = np.random.default_rng(1)
    assert check_tilts("cam1", np.radians(rng.uniform(0, 45, 30))) == []
    [found] = check_tilts("cam1", np.radians(rng.uniform(0, 9, 30)))
    assert "turned away by 8 degrees at most" in found.sentence


def shared(*pairs):
    counts = np.zeros((4, 4))
    for a, b, n in pairs:
        counts[a, b] = counts[b, a] = n
    return counts


def test_cameras_that_are_chained_are_not_flagged():
    assert check_links(NAMES, shared((0, 1, 20), (1, 2, 9), (2, 3, 40))) == []


def test_the_missing_bridge_is_named():
    [found] = check_links(NAMES, shared((0, 1, 20), (1, 2, 2), (2, 3, 40)))
    assert found.cameras == ("cam3", "cam4")
    assert "cam3 and cam4 and cam1 and cam2 share 2 moments" in found.sentence
    assert "where cam2 and cam3 both see it" in found.sentence


def test_every_camera_apart_gets_its_sentence():
    found = check_links(NAMES, shared((0, 1, 20)))
    assert [each.cameras for each in found] == [("cam3",), ("cam4",)]
    assert "cam3 and cam1 and cam2 share 0 moments" in found[0].sentence
    assert "where one and another both see it" in found[0].sentence
