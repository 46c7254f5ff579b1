"""Normal equations of a path whose rows join up to three successive times: banded, solved in linear time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class JoiningRows:
    """Residuals in standard deviations of three successive times each, linear in their unknowns.

    The d unknowns of a time are in groups of w, one after another; k residuals depend on one group alone.
    """

    by_change: Array  # (n - 2, d / w, k, 3, w) their derivatives
    values: Array  # (n - 2, d / w, k)


@dataclass(frozen=True, slots=True, eq=False)
class BandedEquations:
    """A x = right for d unknowns at each of n times, A symmetric and positive definite."""

    blocks: tuple[Array, Array, Array]  # (n - j, d, d): of time i + j, a row, and time i, a column, for j = 0, 1, 2
    right: Array  # (n, d)

    @classmethod
    def of(cls, own: Array, right: Array, *joining: JoiningRows) -> BandedEquations:
        """Join the equations of each time by itself, own (n, d, d) and right (n, d), by rows between times."""
        n, d = right.shape
        blocks, right = (own.copy(), np.zeros((n - 1, d, d)), np.zeros((n - 2, d, d))), right.copy()
        for each in joining:
            w = each.by_change.shape[-1]
            group = np.arange(d // w)
            for i, (rows, values) in enumerate(zip(each.by_change, each.values, strict=True)):
                squares = np.einsum("gksv,gktw->stgvw", rows, rows)
                right[i : i + 3] -= np.einsum("gk,gktw->tgw", values, rows).reshape(3, d)
                for column in range(3):
                    for row in range(column, 3):
                        block = blocks[row - column][i + column].reshape(d // w, w, d // w, w)
                        block[group, :, group] += squares[row, column]
        return cls(blocks, right)

    def solve(self) -> Array:
        """Return x (n, d)."""
        n, d = self.right.shape
        band = np.zeros((3 * d, n * d))
        row, column = np.indices((d, d))
        for j, blocks in enumerate(self.blocks):
            below = j * d + row - column
            is_kept = below >= 0  # the band holds the lower triangle
            for i, block in enumerate(blocks):
                band[below[is_kept], i * d + column[is_kept]] = block[is_kept]
        return np.asarray(solveh_banded(band, self.right.ravel(), lower=True, overwrite_ab=True)).reshape(n, d)
