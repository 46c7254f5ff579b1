"""Calibration boards: their geometry, and the detection of their corners in images."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from airborne.errors import CalibrationError, one_line
from airborne.io.text import read_toml
from airborne.types import Array, Ints

FEWEST_CORNERS = 6  # of a view that determines the board's pose
_THINNEST = 0.05  # width over length of the detected corners: corners on one line leave a rotation free
DICTIONARIES = tuple(sorted(name for name in dir(cv2.aruco) if re.match(r"DICT_[0-9A]", name)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A flat printed board; its corners lie in the plane z = 0, x along a row, y down the rows, z into the paper.

    On a two-sided board the back is the mirror image of the front, each corner behind its own, `thickness_m` deeper.
    """

    kind: Literal["charuco", "chessboard"]
    columns: int  # squares in a row; of a chessboard inner corners in a row
    rows: int  # the same in a column
    square_m: float  # side of a square [m]
    marker_m: float = 0.0  # side of a marker [m]; charuco
    dictionary: str = "DICT_4X4_50"  # charuco
    is_inverted: bool = False  # printed white on black
    is_legacy: bool = False  # even rows begin with a marker, as OpenCV printed them before 4.6
    is_two_sided: bool = False  # charuco
    thickness_m: float = 0.0  # from the front to the back of a two-sided board [m]

    @property
    def corners(self) -> Array:
        """The inner corners (n, 3) [m], row by row; of a thick two-sided board then those of its back (2 n, 3)."""
        nx, ny = self.inner_size
        grid = np.stack(np.meshgrid(np.arange(float(nx)), np.arange(float(ny))), axis=-1).reshape(-1, 2) * self.square_m
        front = np.column_stack([grid, np.zeros(len(grid))])
        return np.concatenate([front, front + np.array([0, 0, self.thickness_m])]) if self.thickness_m else front

    @property
    def inner_size(self) -> tuple[int, int]:
        """The number of inner corners in a row and in a column."""
        return (self.columns - 1, self.rows - 1) if self.kind == "charuco" else (self.columns, self.rows)

    @property
    def is_ambiguous(self) -> bool:
        """Whether the board looks the same after half a revolution."""
        return self.kind == "chessboard" and (self.columns + self.rows) % 2 == 0

    def neighbours(self) -> Ints:
        """Return the pairs of corners one square apart: (k, 2)."""
        nx, ny = self.inner_size
        index = np.arange(nx * ny).reshape(ny, nx)
        across = np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=1)
        down = np.stack([index[:-1].ravel(), index[1:].ravel()], axis=1)
        return np.concatenate([across, down])


class _BoardTable(BaseModel):
    """A board's file: ours, or Caliscope's `charuco.toml` with its own keys for the sizes."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    kind: Literal["charuco", "chessboard"] = "charuco"
    columns: Annotated[int, Field(ge=1, le=100)]
    rows: Annotated[int, Field(ge=1, le=100)]
    square_m: float | None = Field(None, gt=0, le=10)
    square_size_override_cm: float | None = Field(None, gt=0, le=1000)
    marker_m: float | None = Field(None, gt=0, le=10)
    aruco_scale: float = Field(0.75, gt=0, lt=1)
    dictionary: str = "DICT_4X4_50"
    inverted: bool = False
    legacy: bool = False
    two_sided: bool = False
    thickness_m: float = Field(0.0, ge=0, le=0.2)


def read_board(path: str | Path) -> Board:
    """Read a board's TOML file: kind, columns, rows, square_m, and of a charuco marker_m and dictionary.

    Caliscope's `charuco.toml` is read too. Raises CalibrationError for a file that does not say this.
    """
    path = Path(path)
    try:
        document = read_toml(path)
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror}); give a board's file") from None
    except tomllib.TOMLDecodeError as error:
        raise CalibrationError(f"{path} is no TOML file ({str(error).lower()}); expected columns, rows, ...") from None
    return board_from_table(document, str(path))


def board_from_table(table: dict, where: str) -> Board:
    """Return the board that a table describes; raises CalibrationError, naming `where`."""
    try:
        checked = _BoardTable.model_validate(table)
    except ValidationError as error:
        raise CalibrationError(f"{where}: {one_line(error, table, _BoardTable)}") from None
    square_m = checked.square_m or (checked.square_size_override_cm or 0.0) / 100
    if not square_m:
        raise CalibrationError(f"{where}: the size of a square is missing; measure the print and give square_m")
    if checked.dictionary not in DICTIONARIES:
        dictionaries = (
            ", ".join(name for name in DICTIONARIES if name.startswith(checked.dictionary[:8])) or "DICT_4X4_50, ..."
        )
        raise CalibrationError(
            f"{where}: dictionary '{checked.dictionary}' is not known; expected one of: {dictionaries}"
        )
    marker_m = checked.marker_m or checked.aruco_scale * square_m
    if marker_m >= square_m:
        raise CalibrationError(f"{where}: marker_m {marker_m} is not below square_m {square_m}; exchange them?")
    if checked.kind == "chessboard" and (checked.two_sided or checked.thickness_m):
        raise CalibrationError(
            f"{where}: a chessboard looks the same from behind; leave two_sided and thickness_m out, or print a charuco"
        )
    if min(checked.columns, checked.rows) < 3:
        raise CalibrationError(
            f"{where}: {checked.columns}×{checked.rows} is too small; a board has 3 columns and rows at least"
        )
    return Board(
        kind=checked.kind,
        columns=checked.columns,
        rows=checked.rows,
        square_m=square_m,
        marker_m=marker_m,
        dictionary=checked.dictionary,
        is_inverted=checked.inverted,
        is_legacy=checked.legacy,
        is_two_sided=checked.two_sided or checked.thickness_m > 0,
        thickness_m=checked.thickness_m,
    )


@dataclass(frozen=True, slots=True, eq=False)
class DetectedCorners:
    """The corners detected in one image."""

    corner: Ints  # (n,) rows of the board's corners
    px: Array  # (n, 2) [px]
    is_back: bool = False  # of a two-sided board, seen from behind


NO_CORNERS = DetectedCorners(np.zeros(0, int), np.zeros((0, 2)))
Detector = Callable[[NDArray[np.uint8]], DetectedCorners]
Memory = dict[tuple[Board, bytes], DetectedCorners]  # what was detected, by board and image


def board_detector(board: Board, memory: Memory | None = None) -> Detector:
    """Return a detector of the board in grey images (h, w); too few corners, or all on a line, count as none.

    Of a two-sided board it sees the side with more corners. With a memory no image is searched twice.
    """
    find = _charuco_finder(board) if board.kind == "charuco" else _chessboard_finder(board)
    find = find if memory is None else _remembering_finder(board, find, memory)
    find = _two_sided_finder(board, find) if board.is_two_sided else find
    corners = board.corners[:, :2]

    def detect(grey: NDArray[np.uint8]) -> DetectedCorners:
        detected = find(255 - grey if board.is_inverted else grey)
        if len(detected.corner) < FEWEST_CORNERS:
            return NO_CORNERS
        extent = np.linalg.svd(corners[detected.corner] - corners[detected.corner].mean(axis=0), compute_uv=False)
        return detected if extent[1] > _THINNEST * extent[0] else NO_CORNERS

    return detect


def _remembering_finder(board: Board, find: Detector, memory: Memory) -> Detector:
    pattern = replace(board, is_inverted=False, is_two_sided=False, thickness_m=0.0)  # all that `find` depends on

    def remember(grey: NDArray[np.uint8]) -> DetectedCorners:
        contents = hashlib.blake2b(np.ascontiguousarray(grey).data).digest() + repr(grey.shape).encode()
        if (pattern, contents) not in memory:
            memory[pattern, contents] = find(grey)
        return memory[pattern, contents]

    return remember


def mirror_image(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image (h, w) with left and right exchanged."""
    return np.ascontiguousarray(picture[:, ::-1])


def mirror_corners(detected: DetectedCorners, width: int) -> DetectedCorners:
    """Return corners detected in an image of this width as they lie in its mirror image, of the board's other side."""
    px = np.column_stack([width - 1 - detected.px[:, 0], detected.px[:, 1]])
    return replace(detected, px=px, is_back=not detected.is_back)


def _two_sided_finder(board: Board, find: Detector) -> Detector:
    """Return a detector of either side, the back in the mirrored image; it first looks for the side last seen."""
    n, seen_back = board.inner_size[0] * board.inner_size[1], False

    def find_back(grey: NDArray[np.uint8]) -> DetectedCorners:
        back = mirror_corners(find(mirror_image(grey)), grey.shape[1])
        return replace(back, corner=back.corner + (n if board.thickness_m else 0))

    def find_side(grey: NDArray[np.uint8]) -> DetectedCorners:
        nonlocal seen_back
        sides = (find_back, find) if seen_back else (find, find_back)
        best = sides[0](grey)
        if len(best.corner) <= n / 2:
            best = max(best, sides[1](grey), key=lambda side: len(side.corner))
        if len(best.corner):
            seen_back = best.is_back
        return best

    return find_side


def _charuco_finder(board: Board) -> Detector:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    n_markers = board.columns * board.rows // 2
    if n_markers > len(dictionary.bytesList):
        raise CalibrationError(
            f"the board of {board.columns}×{board.rows} squares has {n_markers} markers, {board.dictionary} only "
            f"{len(dictionary.bytesList)}; give the dictionary that it was printed with"
        )
    pattern = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
    pattern.setLegacyPattern(board.is_legacy)
    finder = cv2.aruco.CharucoDetector(pattern)

    def find(grey: NDArray[np.uint8]) -> DetectedCorners:
        px, ids, _, _ = finder.detectBoard(grey)
        if ids is None:
            return NO_CORNERS
        return DetectedCorners(np.asarray(ids, int).ravel(), np.asarray(px, float).reshape(-1, 2))

    return find


def _chessboard_finder(board: Board) -> Detector:
    nx, ny = board.columns, board.rows
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 1e-3)

    def find(grey: NDArray[np.uint8]) -> DetectedCorners:
        is_found, px = cv2.findChessboardCornersSB(grey, (nx, ny), flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        if not is_found:
            quick = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
            is_found, px = cv2.findChessboardCorners(grey, (nx, ny), flags=quick)
            if not is_found:
                return NO_CORNERS
            half = _half_a_square(np.asarray(px, float).reshape(ny, nx, 2))
            px = cv2.cornerSubPix(grey, px, (half, half), (-1, -1), criteria)
        grid = np.asarray(px, float).reshape(ny, nx, 2)
        if np.linalg.det(np.stack([grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]])) < 0:
            grid = grid[:, ::-1]  # seen from the front, rows go down where columns go right
        if not board.is_ambiguous and _brightness(grey, grid[:2, :2]) > _brightness(grey, grid[-2:, -2:]):
            grid = grid[::-1, ::-1]  # the first square is the dark one
        return DetectedCorners(np.arange(nx * ny), grid.reshape(-1, 2))

    return find


def _half_a_square(grid: Array) -> int:
    """Return half a window for refining corners that contains no other corner: from the shortest gap [px]."""
    gaps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1)]
    return int(np.clip(min(gaps) / 2.5, 2, 11))


def _brightness(grey: NDArray[np.uint8], square: Array) -> float:
    """Return the grey level at the centre of a square with corners (2, 2, 2) [px]."""
    u, v = np.clip(np.rint(square.mean(axis=(0, 1))).astype(int), 0, np.array(grey.shape[::-1]) - 1)
    return float(grey[max(v - 1, 0) : v + 2, max(u - 1, 0) : u + 2].mean())
