"""Pictures of printed boards, as a camera without distortion sees them."""

import cv2
import numpy as np

from airborne.calibration.sources.boards import Board

PX_A_SQUARE = 60


def printed(board: Board) -> np.ndarray:
    """The board's print with a white rim of one square; grey (h, w)."""
    n, margin = PX_A_SQUARE, PX_A_SQUARE
    if board.kind == "charuco":
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
        pattern = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
        pattern.setLegacyPattern(board.is_legacy)
        size = (board.columns * n + 2 * margin, board.rows * n + 2 * margin)
        picture = pattern.generateImage(size, marginSize=margin)
    else:
        squares = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
        squares = np.where(squares == 1, 255, 0).astype(np.uint8)  # the first inner square is dark
        picture = np.pad(np.kron(squares, np.ones((n, n), np.uint8)), margin, constant_values=255)
    return 255 - picture if board.is_inverted else picture


def photographed(board: Board, camera, place, *, background=90) -> np.ndarray:
    """The board at world_from_board `place` in a camera's grey picture."""
    camera_from_board = (camera.camera_from_world * place).as_matrix()
    scale = board.square_m / PX_A_SQUARE
    offset = -2 * board.square_m + scale / 2  # of the print's first pixel from the first inner corner, rim and square
    board_from_print = np.array([[scale, 0, offset], [0, scale, offset], [0, 0, 1]])
    px_from_print = camera.K @ camera_from_board[:3, [0, 1, 3]] @ board_from_print
    picture = np.full(camera.size[::-1], background, np.uint8)
    smooth = cv2.GaussianBlur(printed(board), (0, 0), 1.2)
    cv2.warpPerspective(smooth, px_from_print, camera.size, picture, cv2.INTER_AREA, cv2.BORDER_TRANSPARENT)
    return picture
