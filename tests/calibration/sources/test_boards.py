"""Boards: their files, and their corners in pictures."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.sources.board_print import match_print
from airborne.calibration.sources.boards import Board, board_detector, board_from_table, mirror_image, read_board
from airborne.cameras import camera_looking_at
from airborne.errors import CalibrationError
from tests.support.board_prints import photographed

CHARUCO = Board(kind="charuco", columns=5, rows=4, square_m=0.1, marker_m=0.075, dictionary="DICT_4X4_50")
CHESS = Board(kind="chessboard", columns=7, rows=4, square_m=0.08)
CAMERA = camera_looking_at("cam", [0, -1.2, 0], [0, 0, 0], focal_px=800, size=(960, 640))
FACING = Rotation.from_euler("x", -90, degrees=True)  # the board's z along the camera's


def facing(turn_deg=(0, 0, 0), shift=(0, 0, 0)):
    """A board in front of the camera, turned about its own axes."""
    return RigidTransform.from_components(shift, FACING * Rotation.from_euler("zxy", turn_deg, degrees=True))


@pytest.mark.parametrize(
    "board", [CHARUCO, CHESS, replace(CHARUCO, is_inverted=True), replace(CHARUCO, is_legacy=True)]
)
@pytest.mark.parametrize("turn_deg", [(10, 20, -15), (100, -25, 10), (190, 10, 25)])
def test_corners_are_where_the_board_has_them(board, turn_deg):
    place = facing(turn_deg)
    middle = place.apply(board.corners.mean(axis=0))
    place = RigidTransform.from_translation(-middle) * place
    sighting = board_detector(board)(photographed(board, CAMERA, place))
    expected = CAMERA.px_from_world(place.apply(board.corners))
    assert len(sighting.corner) >= 0.7 * len(board.corners)
    off = np.linalg.norm(sighting.px - expected[sighting.corner], axis=1)
    assert np.median(off) < 0.4
    assert off.max() < 1.2


def test_a_chessboard_that_the_finder_by_sectors_misses_is_found_by_the_other(monkeypatch):
    monkeypatch.setattr(cv2, "findChessboardCornersSB", lambda grey, size, flags: (False, None))
    place = facing((10, 20, -15))
    place = RigidTransform.from_translation(-place.apply(CHESS.corners.mean(axis=0))) * place
    sighting = board_detector(CHESS)(photographed(CHESS, CAMERA, place))
    off = np.linalg.norm(sighting.px - CAMERA.px_from_world(place.apply(CHESS.corners))[sighting.corner], axis=1)
    assert len(sighting.corner) == len(CHESS.corners)
    assert off.max() < 0.4


def test_an_image_without_the_board_shows_nothing():
    grey = np.random.default_rng(0).integers(0, 255, (200, 300), dtype=np.uint8)
    for board in (CHARUCO, CHESS):
        assert len(board_detector(board)(grey).corner) == 0


def test_with_a_memory_no_image_is_searched_twice_from_either_side():
    front, memory = photographed(CHARUCO, CAMERA, facing((10, 10, 10))), {}
    both_sides = replace(CHARUCO, is_two_sided=True)
    pictures = (front, front.copy(), mirror_image(front))
    seen = [board_detector(both_sides, memory)(picture) for picture in pictures]
    assert len(memory) == 2
    for picture, sighting in zip(pictures, seen, strict=True):
        expected = board_detector(both_sides)(picture)
        assert np.array_equal(sighting.corner, expected.corner) and np.array_equal(sighting.px, expected.px)
        assert sighting.is_back == expected.is_back
    board_detector(replace(CHARUCO, is_inverted=True), memory)(255 - front)
    assert len(memory) == 2
    board_detector(replace(CHARUCO, columns=4), memory)(front)
    assert len(memory) == 3


def test_a_board_printed_otherwise_is_reported():
    picture = photographed(replace(CHARUCO, is_inverted=True, is_legacy=True), CAMERA, facing((10, 10, 10)))
    board, notes = match_print(CHARUCO, [picture])
    assert board == replace(CHARUCO, is_inverted=True, is_legacy=True)
    assert len(notes) == 1 and "inverted = true and legacy = true" in notes[0]
    same, notes = match_print(CHARUCO, [photographed(CHARUCO, CAMERA, facing())])
    assert same == CHARUCO and notes == ()


def test_boards_that_look_alike_turned_by_half_are_known():
    assert replace(CHESS, columns=8).is_ambiguous
    assert not CHESS.is_ambiguous
    assert not CHARUCO.is_ambiguous


def test_neighbours_are_one_square_apart():
    pairs = CHARUCO.neighbours()
    lengths = np.linalg.norm(CHARUCO.corners[pairs[:, 0]] - CHARUCO.corners[pairs[:, 1]], axis=1)
    np.testing.assert_allclose(lengths, 0.1)
    assert len(pairs) == 3 * 3 + 4 * 2


def test_a_board_file_of_caliscope_is_read(tmp_path):
    path = tmp_path / "charuco.toml"
    path.write_text(
        'columns = 4\nrows = 5\nboard_height = 11.0\ndictionary = "DICT_4X4_1000"\nunits = "inch"\naruco_scale = 0.75\n'
        "square_size_override_cm = 5.4\ninverted = true\n"
    )
    board = read_board(path)
    assert (board.columns, board.rows, board.is_inverted, board.dictionary) == (4, 5, True, "DICT_4X4_1000")
    assert board.square_m == pytest.approx(0.054)
    assert board.marker_m == pytest.approx(0.0405)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"square_m": None}, "size of a square is missing"),
        ({"dictionary": "DICT_9X9"}, "is not known"),
        ({"columns": 2}, "too small"),
        ({"columns": -1}, "columns"),
        ({"marker_m": 0.2}, "not below square_m"),
        ({"square_m": "long"}, "square_m"),
    ],
)
def test_a_board_that_cannot_be_is_refused_in_one_line(change, said):
    table = {"kind": "charuco", "columns": 5, "rows": 4, "square_m": 0.1, "marker_m": 0.075}
    with pytest.raises(CalibrationError, match=said) as caught:
        board_from_table({key: v for key, v in (table | change).items() if v is not None}, "board.toml")
    assert "\n" not in str(caught.value)


def test_too_many_markers_for_the_dictionary_are_refused():
    board = replace(CHARUCO, columns=12, rows=12)
    with pytest.raises(CalibrationError, match="72 markers"):
        board_detector(board)
