"""How a board is printed, by what images show: inverted, legacy, on both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from airborne.calibration.sources.boards import FEWEST_CORNERS, Board, Memory, board_detector, mirror_image
from airborne.types import Image

_CLEAR_RATIO = 2.0  # ratio of corners from which on a board is seen mirrored
_ENOUGH_CORNERS = 2  # corners an image, on average, from which on the board is as described


def match_sides(
    board: Board, pictures: Mapping[str, Sequence[Image]], memory: Memory | None = None
) -> tuple[Board, tuple[str, ...]]:
    """Return the board as two-sided where some cameras see it mirrored and others do not, with a note that says so.

    pictures: by camera. Where every camera sees it mirrored, it stays as it is: then the pictures are mirrored.
    """
    if board.kind != "charuco" or board.is_two_sided:
        return board, ()
    front = {name: _n_corners(board, own, memory) for name, own in pictures.items()}
    back = {
        name: _n_corners(board, [mirror_image(picture) for picture in own], memory)
        for name, own in pictures.items()
        if front[name] < _ENOUGH_CORNERS * len(own)
    }
    behind = [name for name, n in back.items() if n >= _CLEAR_RATIO * max(front[name], FEWEST_CORNERS)]
    if not behind or not any(front[name] >= FEWEST_CORNERS for name in pictures if name not in behind):
        return board, ()
    return replace(board, is_two_sided=True), (
        f"{', '.join(behind)} sees the board mirrored and others do not: it counts as printed on both sides, seen from "
        "behind; of a thick board give thickness_m",
    )


def match_print(board: Board, pictures: Sequence[Image], memory: Memory | None = None) -> tuple[Board, tuple[str, ...]]:
    """Return the board with the pattern (legacy or not, inverted or not) of which most corners are detected.

    The notes say what differs from the description; without any detection the board stays as it is.
    """
    if board.kind != "charuco" or not pictures:
        return board, ()
    described = (board.is_inverted, board.is_legacy)
    counts = {described: _n_corners(board, pictures, memory)}
    kinds = [(inverted, legacy) for inverted in (False, True) for legacy in {False, board.rows % 2 == 0}]
    for inverted, legacy in kinds if counts[described] < _ENOUGH_CORNERS * len(pictures) else ():
        if (inverted, legacy) not in counts:
            other = replace(board, is_inverted=inverted, is_legacy=legacy)
            counts[inverted, legacy] = _n_corners(other, pictures, memory)
    best = max(counts, key=counts.__getitem__)
    if counts[best] <= 1.5 * counts[described]:
        return board, ()
    names = zip(("inverted", "legacy"), best, described, strict=True)
    settings = " and ".join(f"{name} = {str(new).lower()}" for name, new, old in names if new != old)
    return replace(board, is_inverted=best[0], is_legacy=best[1]), (
        f"the board shows {counts[best]} corners with {settings}, {counts[described]} as described; "
        f"went on with {settings}",
    )


def _n_corners(board: Board, pictures: Sequence[Image], memory: Memory | None) -> int:
    detect = board_detector(board, memory)
    return sum(len(detect(picture).corner) for picture in pictures)


def turn_to_front(board: Board, pictures: Sequence[Image], memory: Memory | None = None) -> tuple[Board, list[Image]]:
    """Return a two-sided board as one-sided, and its images with those of the back mirrored."""
    if not board.is_two_sided:
        return board, list(pictures)
    detect = board_detector(board, memory)
    fronts = [mirror_image(picture) if detect(picture).is_back else picture for picture in pictures]
    return replace(board, is_two_sided=False, thickness_m=0.0), fronts
