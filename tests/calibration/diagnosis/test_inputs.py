"""A board whose file gives it a size that nobody holds is named."""

import pytest

from airborne.calibration.diagnosis.inputs import check_board_size
from airborne.calibration.sources.boards import Board


@pytest.mark.parametrize(
    ("square_m", "is_named"), [(0.054, False), (0.54, True), (54.0, True), (0.2, False), (5e-4, True)]
)
def test_a_board_of_metres_or_of_millimetres_is_named(square_m, is_named):
    board = Board(kind="charuco", columns=4, rows=5, square_m=square_m, marker_m=0.75 * square_m)
    found = check_board_size(board)
    assert len(found) == is_named
    assert not found or f"squares of {square_m:.3g} m" in found[0].sentence
