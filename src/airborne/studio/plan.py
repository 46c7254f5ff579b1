"""Surveyed points seen from above, the chosen one marked: which point a name means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.export.palette import VERMILION
from airborne.types import Array

_WIDE_PX, _HIGH_PX, _RIM_PX = 270, 110, 8  # of the drawing, at most; about the points
_POINT, _CHOSEN, _LINE = "#5d666f", VERMILION, "#9aa3ab"


def plan_svg(world: Array, chosen: int, lines: Sequence[Array]) -> str:
    """Draw points (n, 3) [m] and lines (2, 3) [m] from above, the longer side to the right; row `chosen` stands out."""
    ends = np.array([end for line in lines for end in line]).reshape(-1, 3)
    is_long = bool(np.ptp(world[:, 1]) > np.ptp(world[:, 0]))
    points, ends = _from_above(world, is_long), _from_above(ends, is_long)
    low, span = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-6)
    scale = float(min((np.array([_WIDE_PX, _HIGH_PX]) - 2 * _RIM_PX) / span))
    width, height = (span * scale + 2 * _RIM_PX).round().astype(int).tolist()
    at, ends = ((each - low) * scale + _RIM_PX for each in (points, ends))
    drawn = [
        f'<line x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}" stroke="{_LINE}"/>'
        for (a, b), (c, d) in ends.reshape(-1, 2, 2).tolist()
    ]
    drawn += [f'<circle cx="{u:.1f}" cy="{v:.1f}" r="2" fill="{_POINT}"/>' for u, v in at.tolist()]
    u, v = at[chosen].tolist()
    drawn.append(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="5" fill="{_CHOSEN}"/>')
    head = f'<svg width="{width}" height="{height}" role="img" aria-label="the points from above">'
    return f"{head}{''.join(drawn)}</svg>"


def _from_above(points: Array, is_long: bool) -> Array:
    """Return where points (n, 3) lie in a drawing whose second axis points down; of a long plan y is to the right."""
    x, y = points[:, 0], points[:, 1]
    return np.stack([y, x] if is_long else [x, -y], axis=1)
