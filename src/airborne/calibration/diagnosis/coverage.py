"""Checks of coverage: number of views, coverage of the image, tilts of the board, moments shared by cameras."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.sparse.csgraph import connected_components

from airborne.cameras.finding import Finding, join_names
from airborne.errors import count
from airborne.types import Array

_FEWEST_VIEWS = 8  # of a board, for a lens
_CELLS = (6, 4)  # of the image, across and down
_LEAST_COVERAGE = 0.25  # least share of them with points
_EMPTY = 0.15  # of the cells of a side of the image: a side with fewer is named
_LEAST_TILT = np.radians(20)  # from facing the camera, that a board should reach now and then
_TILTED_SHARE = 0.9  # quantile of the tilts that must reach it
_FEWEST_POINTS = 60  # that could cover an image
_FEWEST_SHARED = 5  # moments that link two cameras


def check_view_count(camera: str, n_views: int) -> list[Finding]:
    """Report too few views of the board."""
    if n_views >= _FEWEST_VIEWS:
        return []
    return [
        Finding(
            kind="coverage",
            what=f"{camera} shows the board in {count(n_views, 'image')}, expected {_FEWEST_VIEWS}",
            advice="film it longer, in all parts of the image, near and far",
            cameras=(camera,),
        )
    ]


def check_coverage(camera: str, px: Array, size: tuple[int, int]) -> list[Finding]:
    """Report points (n, 2) [px] that leave much of an image (width, height) empty; a few clicks are exempt."""
    px = px[np.isfinite(px).all(axis=1)]
    if len(px) < _FEWEST_POINTS:
        return []
    cell = np.clip((px / size * _CELLS).astype(int), 0, np.array(_CELLS) - 1)
    filled = np.zeros(_CELLS, bool)
    filled[cell[:, 0], cell[:, 1]] = True
    if filled.mean() >= _LEAST_COVERAGE:
        return []
    parts = {"left": filled[:2], "right": filled[-2:], "upper": filled[:, :1], "lower": filled[:, -1:]}
    empty = [name for name, part in parts.items() if part.mean() < _EMPTY]
    borders = (
        "near its borders" if len(empty) == len(parts) else f"in its {join_names(empty)} part{'s' * (len(empty) > 1)}"
    )
    where = f", hardly any {borders}" if empty else ""
    return [
        Finding(
            kind="coverage",
            what=f"{camera} has points in {filled.mean():.0%} of its image{where}",
            advice="the lens and the place are guessed where there is nothing; cover the whole image",
            cameras=(camera,),
        )
    ]


def check_tilts(camera: str, tilts_rad: Array) -> list[Finding]:
    """Report a board that nearly always faces the camera; tilts (n,) from facing it [rad]."""
    if len(tilts_rad) < _FEWEST_VIEWS or np.quantile(tilts_rad, _TILTED_SHARE) >= _LEAST_TILT:
        return []
    return [
        Finding(
            kind="coverage",
            what=f"{camera} sees the board turned away by {np.degrees(np.max(tilts_rad)):.0f} degrees at most",
            advice="focal length and distance are poorly told apart; tilt it by 30 to 45 degrees, to all sides",
            cameras=(camera,),
        )
    ]


def check_links(names: Sequence[str], n_shared: Array, what: str = "moments") -> list[Finding]:
    """Report cameras that are not linked to the others; n_shared (cameras, cameras) counts what two see at once."""
    n_groups, group = connected_components(np.asarray(n_shared) >= _FEWEST_SHARED, directed=False)
    return (
        list(_missing_links(names, np.asarray(n_shared), group=group, n_groups=n_groups, what=what))
        if n_groups > 1
        else []
    )


def _missing_links(
    names: Sequence[str], n_shared: Array, *, group: Array, n_groups: int, what: str
) -> Iterator[Finding]:
    main = int(np.argmax(np.bincount(group)))
    for other in (g for g in range(n_groups) if g != main):
        here, there = np.flatnonzero(group == main), np.flatnonzero(group == other)
        between = n_shared[np.ix_(here, there)]
        i, j = divmod(int(np.argmax(between)), len(there))
        a, b, most = names[int(here[i])], names[int(there[j])], int(between[i, j])
        separate = tuple(names[int(k)] for k in there)
        nearest = f"; {a} and {b} come nearest" if most else ""
        yield Finding(
            kind="bridge",
            what=(
                f"{join_names(separate)} and {join_names([names[int(k)] for k in here])} share {most} {what}, "
                f"expected {_FEWEST_SHARED} or more between two of them{nearest}"
            ),
            advice=f"film board or wand where {a if most else 'one'} and {b if most else 'another'} both see it",
            cameras=separate,
        )
