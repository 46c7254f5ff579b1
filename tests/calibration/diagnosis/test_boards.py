"""Boards that are not as described: every mistake made to pictures of a print, and to a real recording."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.diagnosis.boards import check_board_print
from airborne.calibration.sources.boards import Board, read_board
from airborne.cameras import camera_looking_at
from tests.support.board_prints import photographed

CHARUCO = Board(kind="charuco", columns=5, rows=4, square_m=0.1, marker_m=0.07, dictionary="DICT_5X5_50")
CHESS = Board(kind="chessboard", columns=7, rows=4, square_m=0.08)
CAMERA = camera_looking_at("cam", [0, -1.2, 0], [0, 0, 0], focal_px=300, size=(350, 250))


def pictures(board, n=3):
    """The board turned to all sides, in the middle of the picture."""
    found = []
    for k in range(n):
        turn = Rotation.from_euler("x", -90, degrees=True) * Rotation.from_euler("zxy", [8 * k, 15 - 8 * k, 9], True)
        place = RigidTransform.from_components(np.zeros(3), turn)
        place = RigidTransform.from_translation(-place.apply(board.corners.mean(axis=0))) * place
        found.append(photographed(board, CAMERA, place))
    return found


def sentence(described, shown):
    found = check_board_print(described, shown, "cam1")
    assert len(found) == 1
    assert found[0].cameras == ("cam1",)
    assert "\n" not in found[0].sentence
    return found[0].sentence


@pytest.mark.parametrize(
    "board", [CHARUCO, CHESS, replace(CHARUCO, is_inverted=True), replace(CHARUCO, is_legacy=True)]
)
def test_the_right_board_is_not_flagged(board):
    assert check_board_print(board, pictures(board), "cam1") == []


def test_another_dictionary_is_named():
    said = sentence(replace(CHARUCO, dictionary="DICT_6X6_50"), pictures(CHARUCO, 2))
    assert said.startswith("cam1: 0 markers are seen as the board is described")
    assert said.endswith('the print is another one; set dictionary = "DICT_5X5_50"')


def test_a_print_in_reverse_is_named():
    said = sentence(CHARUCO, pictures(replace(CHARUCO, is_inverted=True), 2))
    assert said.endswith("the print is another one; set inverted = true")


def test_columns_and_rows_exchanged_are_named():
    said = sentence(replace(CHARUCO, columns=4, rows=5), pictures(CHARUCO))
    assert "100% with columns = 5 and rows = 4" in said
    assert "columns and rows are exchanged" in said


def test_another_number_of_squares_is_named():
    assert "columns = 5 and rows = 4" in sentence(replace(CHARUCO, columns=7, rows=6), pictures(CHARUCO))


def test_another_size_of_markers_is_named():
    said = sentence(replace(CHARUCO, marker_m=0.05), pictures(CHARUCO))
    assert "of a square in the images, 0.50 as described" in said
    assert 0.064 < float(said.rsplit("= ", 1)[1]) < 0.074


def test_mirrored_images_are_named():
    mirrored = [np.ascontiguousarray(picture[:, ::-1]) for picture in pictures(CHARUCO)]
    assert "the images are mirrored" in sentence(CHARUCO, mirrored)


def test_squares_counted_for_inner_corners_are_reported():
    said = sentence(replace(CHESS, columns=8, rows=5), pictures(CHESS))
    assert "squares were counted, not the inner corners; set columns = 7 and rows = 4" in said


def test_nothing_in_the_images_is_reported_as_that():
    empty = [np.full((250, 350), 90, np.uint8)] * 3
    assert "found in 0 of 3 images, with 0 of its 12 corners at most" in sentence(CHARUCO, empty)
    assert "no other board is either" in sentence(CHESS, empty)
    assert check_board_print(CHARUCO, [], "cam1") == []


@pytest.fixture(scope="module")
def real(shared_data):
    """A real board, and some of one camera's pictures of it."""
    folder = shared_data("charuco")
    video, greys = cv2.VideoCapture(str(folder / "cam_1.mp4")), []
    while (read := video.read())[0]:
        greys.append(cv2.cvtColor(read[1], cv2.COLOR_BGR2GRAY))
    return read_board(folder / "charuco.toml"), greys[::24]


def test_a_real_board_is_not_flagged(real):
    assert check_board_print(*real, "cam_1") == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"dictionary": "DICT_6X6_250"}, 'set dictionary = "DICT_4X4_50"'),
        ({"marker_m": 0.02}, "of a square in the images, 0.37 as described"),
    ],
)
def test_a_wrong_description_of_a_real_board_is_named(real, change, said):
    board, greys = real
    assert said in sentence(replace(board, **change), greys)
