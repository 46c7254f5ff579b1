"""Boards printed on both sides: seen from behind, the corners are where they are."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.bundle import FreeParameters, adjust
from airborne.calibration.diagnosis.boards import check_board_print
from airborne.calibration.initial.chaining import Views, board_source, chain_cameras
from airborne.calibration.initial.mirrored import find_mirrored_cameras
from airborne.calibration.sources.board_print import match_sides
from airborne.calibration.sources.boards import (
    NO_CORNERS,
    Board,
    DetectedCorners,
    board_detector,
    board_from_table,
    mirror_corners,
    mirror_image,
)
from airborne.cameras import Rig
from airborne.errors import CalibrationError
from tests.calibration.sources.test_boards import CAMERA, CHARUCO, facing
from tests.support.board_prints import photographed
from tests.support.rigs import BOARD, apart, boards, ring

PICTURE = photographed(CHARUCO, CAMERA, facing((10, 20, -15), (-0.15, 0, 0.1)))
TWO_SIDED = replace(CHARUCO, is_two_sided=True)


def observe_both_sides(rng, rig, places, board, noise_px=0.2):
    """What the rig sees of a board of which every corner is seen, from the front or from behind."""
    n, rows = board.inner_size[0] * board.inner_size[1], []
    for camera in rig:
        row = []
        for place in places:
            toward = place.inv().apply(camera.centre)
            is_back = toward[2] > 0
            corner = np.arange(n) + (n if is_back and board.thickness_m else 0)
            px = camera.px_from_world(place.apply(board.corners[corner]))
            is_seen = abs(toward[2]) > 0.3 * np.linalg.norm(toward) and np.isfinite(px).all()
            noise = noise_px * rng.standard_normal(px.shape)
            row.append(DetectedCorners(corner, px + noise, bool(is_back)) if is_seen else NO_CORNERS)
        rows.append(tuple(row))
    return Views(board, rig.names, tuple(rows))


def test_the_mirrored_picture_is_the_back_with_the_same_corners():
    front, back = board_detector(TWO_SIDED)(PICTURE), board_detector(TWO_SIDED)(mirror_image(PICTURE))
    assert not front.is_back and back.is_back
    order = np.argsort(back.corner)
    assert np.array_equal(back.corner[order], np.sort(front.corner))
    mirrored = mirror_corners(back, PICTURE.shape[1])
    np.testing.assert_allclose(mirrored.px[order], front.px[np.argsort(front.corner)], atol=1e-6)
    thick = board_detector(replace(TWO_SIDED, thickness_m=0.01))(mirror_image(PICTURE))
    assert np.array_equal(thick.corner, back.corner + 12)


def test_one_sided_boards_are_not_seen_from_behind():
    assert len(board_detector(CHARUCO)(mirror_image(PICTURE)).corner) == 0


def test_the_back_lies_behind_the_front_by_the_thickness():
    corners = replace(TWO_SIDED, thickness_m=0.004).corners
    np.testing.assert_allclose(corners[12:] - corners[:12], np.tile([0, 0, 0.004], (12, 1)))


def test_it_is_noticed_where_some_cameras_see_it_mirrored_and_others_do_not():
    front, back = [PICTURE] * 3, [mirror_image(PICTURE)] * 3
    board, notes = match_sides(CHARUCO, {"a": front, "b": back, "c": front})
    assert board == TWO_SIDED
    assert len(notes) == 1 and notes[0].startswith("b sees the board mirrored and others do not")
    for pictures in ({"a": front}, {"a": back, "b": back}, {"a": front, "b": [np.zeros_like(PICTURE)] * 3}):
        assert match_sides(CHARUCO, pictures) == (CHARUCO, ())


def test_the_print_of_a_board_seen_from_behind_is_as_described():
    assert check_board_print(TWO_SIDED, [mirror_image(PICTURE)] * 6) == []
    assert [finding.kind for finding in check_board_print(CHARUCO, [mirror_image(PICTURE)] * 6)] == ["mirrored"]


@pytest.mark.parametrize("thickness_m", [0.0, 0.03])
def test_cameras_that_face_each_other_are_joined_by_one_board(thickness_m):
    rng, rig = np.random.default_rng(0), ring(4)
    board = replace(BOARD, is_two_sided=True, thickness_m=thickness_m)
    views = observe_both_sides(rng, rig, boards(rng, 30), board)
    start, places = chain_cameras(list(rig), views)
    found = adjust(start, [board_source(views, places)], FreeParameters(focal=False))
    assert found.rms_px() < 0.35
    np.testing.assert_allclose(apart(found.rig), apart(rig), rtol=1e-3)


def test_a_thickness_left_out_shows_in_the_residuals():
    rng, rig = np.random.default_rng(0), ring(4)
    views = observe_both_sides(rng, rig, boards(rng, 30), replace(BOARD, is_two_sided=True, thickness_m=0.03))
    thin = replace(BOARD, is_two_sided=True)
    rows = tuple(tuple(replace(s, corner=s.corner % 30) for s in row) for row in views.detections)
    start, places = chain_cameras(list(rig), replace(views, board=thin, detections=rows))
    found = adjust(start, [board_source(replace(views, board=thin, detections=rows), places)], FreeParameters())
    assert found.rms_px() > 1.5


@pytest.mark.parametrize("thickness_m", [0.0, 0.03])
def test_a_mirrored_camera_is_no_camera_behind(thickness_m):
    rng, rig = np.random.default_rng(0), ring(3)
    board, places = replace(BOARD, is_two_sided=True, thickness_m=thickness_m), boards(rng, 60)
    views = observe_both_sides(rng, rig, places, board)
    first, second, _ = views.detections
    only_front = tuple(s if not s.is_back else NO_CORNERS for s in first)
    only_back = tuple(s if s.is_back else NO_CORNERS for s in second)
    behind = Views(board, rig.names[:2], (only_front, only_back))
    assert find_mirrored_cameras(rig.cameras[:2], behind) == []
    n = BOARD.inner_size[0] * BOARD.inner_size[1]
    as_mirrored = tuple(
        replace(mirror_corners(s, rig.cameras[1].size[0]), corner=s.corner + (n if thickness_m else 0))
        if len(s.corner) and not s.is_back
        else NO_CORNERS
        for s in second
    )
    views = Views(board, rig.names[:2], (only_front, as_mirrored))
    straight = [camera.without_distortion() for camera in rig.cameras[:2]]
    assert find_mirrored_cameras(Rig(tuple(straight)).cameras, views) == ["cam1"]


def test_a_board_file_says_so_and_a_chessboard_cannot():
    table = {"kind": "charuco", "columns": 5, "rows": 4, "square_m": 0.1, "thickness_m": 0.005}
    assert board_from_table(table, "x") == replace(
        Board(kind="charuco", columns=5, rows=4, square_m=0.1, marker_m=0.1 * 0.75),
        is_two_sided=True,
        thickness_m=0.005,
    )
    with pytest.raises(CalibrationError, match="a chessboard looks the same from behind"):
        board_from_table(table | {"kind": "chessboard"}, "x")
