"""Plain tables for a terminal: columns as wide as their longest cell."""

from __future__ import annotations

from collections.abc import Sequence


def align_columns(rows: Sequence[Sequence[str]], least: Sequence[int]) -> list[str]:
    """Return rows of cells as lines, the first column flush left, others right, titles of one cell.

    `least` are the smallest widths.
    """
    widths = [max(width, *(len(row[k]) + 1 for row in rows if len(row) > 1)) for k, width in enumerate(least)]
    return ["".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in rows]
