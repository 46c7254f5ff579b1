"""Does the board's description match its print? Tests images for another dictionary, layout, or marker size."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.calibration.sources.board_print import turn_to_front
from airborne.calibration.sources.boards import DICTIONARIES, Board, Memory, board_detector, mirror_image
from airborne.cameras.finding import Finding, join_names
from airborne.types import Array, Image

_MOST_PICTURES, _MOST_SEARCHED = 12, 6  # evenly spaced; the latter are searched for every dictionary
_DETECTED_SHARE = 0.3  # share of the images, and of the corners in them, from which on the board is as described
_FEWEST_MARKERS = 4  # in an image that determines a layout
_FEWEST_PICTURES = 2  # with the same finding, before it is reported
_CLEAR_RATIO = 2.0  # ratio of markers from which on another dictionary is the right one
_WIDEST, _MOST_COMPARED = 15, 3  # most columns or rows tried, images that they are tried on
_STRAIGHT_PX = 5.0  # how far a marker's centre may lie off its position on the board
_FITTING_SHARE = 0.8  # least share of the markers within it
_RATIO_OFF = 0.12  # relative difference of the markers' size; blur makes them seem smaller
_CHESS_SIZE = (3, 3)  # inner corners of the smallest board searched for


@dataclass(frozen=True, slots=True, eq=False)
class _Markers:
    """The markers of one image."""

    ids: NDArray[np.integer]  # (n,)
    px: Array  # (n, 4, 2) [px], clockwise from the top left


def check_board_print(
    board: Board, pictures: Sequence[Image], camera: str = "", memory: Memory | None = None
) -> list[Finding]:
    """Report what in a board's description does not match its print, from grey images (h, w); empty if it is detected.

    Of a charuco board: dictionary, inverted print, mirrored images, columns and rows, the markers' size. Of a
    chessboard: its inner corners. A square's size in metres cannot be seen; measure the print.
    """
    if not len(pictures):
        return []
    sample = [pictures[i] for i in np.unique(np.linspace(0, len(pictures) - 1, _MOST_PICTURES).astype(int))]
    board, sample = turn_to_front(board, sample, memory)
    where = f"{camera}: " if camera else ""
    counts = _corner_counts(board, sample, memory)
    n_corners = board.inner_size[0] * board.inner_size[1]
    detected = [count for count in counts if count]
    if board.kind == "chessboard":
        is_found = len(detected) >= max(_DETECTED_SHARE * len(sample), 1)
        return [] if is_found else _wrong_chessboard(board, sample, where, camera)
    is_found = len(detected) >= _DETECTED_SHARE * len(sample) and bool(
        np.median(detected) >= _DETECTED_SHARE * n_corners
    )
    findings = list(_wrong_charuco(board, sample, where, camera, is_found=is_found))
    return findings if findings or is_found else [_not_detected(board, sample, counts, where=where, camera=camera)]


def _corner_counts(board: Board, pictures: Sequence[Image], memory: Memory | None = None) -> list[int]:
    return [len(sighting.corner) for sighting in map(board_detector(board, memory), pictures)]


def _not_detected(
    board: Board, pictures: Sequence[Image], counts: Sequence[int], *, where: str, camera: str
) -> Finding:
    n_detected, n_corners = sum(count > 0 for count in counts), board.inner_size[0] * board.inner_size[1]
    return Finding(
        kind="board",
        what=(
            f"{where}the board is found in {n_detected} of {len(pictures)} images, with {max(counts)} of its "
            f"{n_corners} corners at most, and no other board is either"
        ),
        advice="show it larger, flat, sharp and without glare, with its white border free",
        cameras=(camera,) if camera else (),
    )


def _wrong_charuco(
    board: Board, pictures: Sequence[Image], where: str, camera: str, *, is_found: bool
) -> Iterator[Finding]:
    about = (camera,) if camera else ()
    if not is_found:
        sample = pictures[:: max(len(pictures) // _MOST_SEARCHED, 1)]
        n_here = _n_markers(_all_markers(sample, board.dictionary, board.is_inverted))
        mirrored = [mirror_image(picture) for picture in sample]
        n_mirrored = _n_markers(_all_markers(mirrored, board.dictionary, board.is_inverted))
        if n_mirrored >= _CLEAR_RATIO * max(n_here, _FEWEST_MARKERS):
            yield Finding(
                kind="mirrored",
                what=f"{where}{n_here} of the board's markers are seen, {n_mirrored} once the images are mirrored",
                advice="the images are mirrored; switch off the camera's mirror image and record or convert anew",
                cameras=about,
            )
            return
        is_own_seen = n_here >= _FEWEST_MARKERS * len(sample)
        dictionary, is_inverted, n_there = ("", False, 0) if is_own_seen else _likeliest_print(board, sample)
        if n_there >= _CLEAR_RATIO * max(n_here, _FEWEST_MARKERS):
            yield _other_print(board, dictionary, is_inverted, where=where, about=about, counts=(n_here, n_there))
            board = replace(board, dictionary=dictionary, is_inverted=is_inverted)
    yield from _wrong_layout(board, _all_markers(pictures, board.dictionary, board.is_inverted), where, about)


def _other_print(
    board: Board, dictionary: str, is_inverted: bool, *, where: str, about: tuple[str, ...], counts: tuple[int, int]
) -> Finding:
    settings = [f'dictionary = "{dictionary}"'] * (dictionary != board.dictionary)
    settings += [f"inverted = {str(is_inverted).lower()}"] * (is_inverted != board.is_inverted)
    return Finding(
        kind="board",
        what=f"{where}{counts[0]} markers are seen as the board is described, {counts[1]} with {join_names(settings)}",
        advice=f"the print is another one; set {join_names(settings)}",
        cameras=about,
    )


def _wrong_layout(
    board: Board, markers_of: Sequence[_Markers], where: str, about: tuple[str, ...]
) -> Iterator[Finding]:
    usable = [markers for markers in markers_of if len(markers.ids) >= _FEWEST_MARKERS]
    if len(usable) < _FEWEST_PICTURES:
        return
    fit = _layout_fit(board, usable)
    if fit < _FITTING_SHARE:
        clearest = sorted(usable, key=lambda markers: -len(markers.ids))[:_MOST_COMPARED]
        best = max(_layouts(board, usable), key=lambda other: _layout_fit(other, clearest), default=board)
        if _layout_fit(best, usable) >= _FITTING_SHARE:
            described = f"{board.columns} columns and {board.rows} rows"
            print_ = f"columns = {best.columns} and rows = {best.rows}"
            legacy = f", legacy = {str(best.is_legacy).lower()}" if best.is_legacy != board.is_legacy else ""
            swapped = (best.columns, best.rows) == (board.rows, board.columns)
            yield Finding(
                kind="board",
                what=(
                    f"{where}{fit:.0%} of the markers lie where a board of {described} has them, "
                    f"{_layout_fit(best, usable):.0%} with {print_}{legacy}"
                ),
                advice=(
                    f"{'columns and rows are exchanged; ' if swapped else ''}count the squares of the print and set "
                    f"{print_}{legacy}"
                ),
                cameras=about,
            )
            board = best
    ratio = _marker_ratio(board, usable)
    stated = board.marker_m / board.square_m
    if np.isfinite(ratio) and abs(ratio / stated - 1) > _RATIO_OFF:
        yield Finding(
            kind="board",
            what=f"{where}markers are {ratio:.2f} of a square in the images, {stated:.2f} as described",
            advice=f"measure the print; with these squares marker_m = {ratio * board.square_m:.4f}",
            cameras=about,
        )


def _detect_markers(picture: Image, dictionary: str) -> _Markers:
    finder = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)))
    corners, ids, _ = finder.detectMarkers(picture)
    if ids is None:
        return _Markers(np.zeros(0, int), np.zeros((0, 4, 2)))
    return _Markers(np.asarray(ids, int).ravel(), np.asarray(corners, float).reshape(-1, 4, 2))


def _n_markers(markers_of: Sequence[_Markers]) -> int:
    return sum(len(markers.ids) for markers in markers_of)


def _all_markers(pictures: Sequence[Image], dictionary: str, is_inverted: bool) -> list[_Markers]:
    """Return every image's markers, without ids that only one image shows: false detections."""
    detections = [_detect_markers(255 - picture if is_inverted else picture, dictionary) for picture in pictures]
    ids, counts = np.unique(np.concatenate([markers.ids for markers in detections]), return_counts=True)
    repeated = ids[counts >= _FEWEST_PICTURES]
    is_repeated = [np.isin(markers.ids, repeated) for markers in detections]
    return [
        _Markers(markers.ids[rows], markers.px[rows]) for markers, rows in zip(detections, is_repeated, strict=True)
    ]


def _likeliest_print(board: Board, pictures: Sequence[Image]) -> tuple[str, bool, int]:
    """Return the dictionary with most detected markers, whether the print is inverted, and how many.

    Of a family that differs only in the number of markers the largest is searched, the smallest that holds all named.
    """
    families = {name.rsplit("_", 1)[0]: name for name in sorted(DICTIONARIES, key=_dictionary_size)}
    kinds = [(name, inverted) for name in families.values() for inverted in (board.is_inverted, not board.is_inverted)]
    detections = {kind: _all_markers(pictures, *kind) for kind in kinds}
    best, is_inverted = max(kinds, key=lambda kind: _n_markers(detections[kind]))
    markers_of = detections[best, is_inverted]
    if sum(len(markers.ids) >= _FEWEST_MARKERS for markers in markers_of) < _FEWEST_PICTURES:
        return board.dictionary, board.is_inverted, 0
    last = max(int(markers.ids.max(initial=0)) for markers in markers_of)
    if best.rsplit("_", 1)[0] == board.dictionary.rsplit("_", 1)[0] and _dictionary_size(board.dictionary) > last:
        return board.dictionary, is_inverted, _n_markers(markers_of)
    family = [name for name in DICTIONARIES if name.rsplit("_", 1)[0] == best.rsplit("_", 1)[0]]
    return (
        next(name for name in sorted(family, key=_dictionary_size) if _dictionary_size(name) > last),
        is_inverted,
        _n_markers(markers_of),
    )


def _dictionary_size(dictionary: str) -> int:
    return len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList)


def _layouts(board: Board, detections: Sequence[_Markers]) -> Iterator[Board]:
    """Yield boards of other columns and rows that have all detected markers; an extra row changes nothing else."""
    last = max(int(markers.ids.max()) for markers in detections)
    for columns in range(2, _WIDEST + 1):
        fewest_rows = max(2, int(np.ceil(2 * (last + 1) / columns)))
        for rows in {fewest_rows, fewest_rows + 1, board.rows, board.columns}:
            for is_legacy in {board.is_legacy, not board.is_legacy}:
                if 2 <= rows <= _WIDEST and columns * rows // 2 > last:
                    yield replace(board, columns=columns, rows=rows, is_legacy=is_legacy)


def _plane_corners(board: Board) -> Array:
    """Return the markers' corners in the board's plane: (markers, 4, 2) in squares, by marker."""
    squares = [
        (column, row)
        for row in range(board.rows)
        for column in range(board.columns)
        if (column + row) % 2 == (0 if board.is_legacy and board.rows % 2 == 0 else 1)
    ]
    half = board.marker_m / board.square_m / 2
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    return np.array(squares, float)[:, None] + 0.5 + corners


def _plane_fits(board: Board, detections: Sequence[_Markers]) -> Iterator[tuple[Array, Array, Array]]:
    """Yield every image's homography from plane to px, and the markers' corners (n, 4, 2) in both."""
    plane = _plane_corners(board)
    for markers in detections:
        is_on_board = markers.ids < len(plane)
        if is_on_board.sum() >= _FEWEST_MARKERS:
            in_plane, px = plane[markers.ids[is_on_board]], markers.px[is_on_board]
            H, _ = cv2.findHomography(
                in_plane.reshape(-1, 2), px.reshape(-1, 2), cv2.RANSAC, _STRAIGHT_PX, maxIters=200
            )
            if H is not None and abs(np.linalg.det(H)) > 1e-12:
                yield np.asarray(H, float), in_plane, px


def _layout_fit(board: Board, detections: Sequence[_Markers]) -> float:
    """Return the share of the markers that lie where the layout puts them."""
    n_near = 0
    for H, in_plane, px in _plane_fits(board, detections):
        centres = cv2.perspectiveTransform(in_plane.mean(axis=1)[:, None], H)[:, 0]
        n_near += int((np.linalg.norm(centres - px.mean(axis=1), axis=1) < _STRAIGHT_PX).sum())
    return n_near / _n_markers(detections)


def _marker_ratio(board: Board, detections: Sequence[_Markers]) -> float:
    """Return the side of a marker in squares, as seen; NaN for too few markers."""
    sides = []
    for _, in_plane, px in _plane_fits(board, detections):
        H, _ = cv2.findHomography(px.mean(axis=1), in_plane.mean(axis=1), cv2.LMEDS)
        if H is None:
            continue
        corners = cv2.perspectiveTransform(px.reshape(-1, 1, 2), H).reshape(-1, 4, 2)
        sides.append(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).ravel())
    return float(np.median(np.concatenate(sides))) if sides else float("nan")


def _wrong_chessboard(board: Board, pictures: Sequence[Image], where: str, camera: str) -> list[Finding]:
    """Search for chessboards of any size, including partial ones; take the size that most images show completely."""
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_LARGER
    sizes = set()
    for picture in pictures[:: max(len(pictures) // _MOST_SEARCHED, 1)]:
        is_found, _, meta = cv2.findChessboardCornersSBWithMeta(picture, _CHESS_SIZE, flags)
        if is_found and meta is not None:
            sizes.add((min(meta.shape[:2]), max(meta.shape[:2])))
    counts = {
        size: sum(bool(count) for count in _corner_counts(replace(board, columns=size[0], rows=size[1]), pictures))
        for size in sizes - {(min(board.inner_size), max(board.inner_size))}
    }
    short, long = max(counts, key=lambda size: (counts[size], size), default=(0, 0))
    n_detected = counts.get((short, long), 0)
    if n_detected < _FEWEST_PICTURES:
        return [_not_detected(board, pictures, _corner_counts(board, pictures), where=where, camera=camera)]
    columns, rows = (long, short) if board.columns >= board.rows else (short, long)
    squares = (columns + 1, rows + 1) == (board.columns, board.rows)
    return [
        Finding(
            kind="board",
            what=(
                f"{where}no chessboard of {board.columns} by {board.rows} inner corners is seen, but one of {columns} "
                f"by {rows} in {n_detected} of {len(pictures)} images"
            ),
            advice=(
                f"{'squares were counted, not the inner corners; ' if squares else ''}set columns = {columns} and "
                f"rows = {rows}"
            ),
            cameras=(camera,) if camera else (),
        )
    ]
