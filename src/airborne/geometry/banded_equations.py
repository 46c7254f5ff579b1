"""Normal equations of a path whose rows join up to three successive times: banded, solved in linear time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

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

    def solve(self, rights: Array | None = None) -> Array:
        """Return x (n, d); or for other right sides (n, d, k) their solutions (n, d, k)."""
        n, d = self.right.shape
        rights = self.right if rights is None else rights
        band = np.zeros((3 * d, n * d))
        row, column = np.indices((d, d))
        for j, blocks in enumerate(self.blocks):
            below = j * d + row - column
            is_kept = below >= 0  # the band holds the lower triangle
            for i, block in enumerate(blocks):
                band[below[is_kept], i * d + column[is_kept]] = block[is_kept]
        columns = rights.reshape(n * d, -1)
        return np.asarray(solveh_banded(band, columns, lower=True, overwrite_ab=True)).reshape(rights.shape)

    def covariances(self) -> Array:
        """Return the diagonal blocks of the inverse of A, each time's marginal covariance: (n, d, d).

        By a forward and a backward recursion over pairs of times, whose matrix is block tridiagonal (Takahashi 1973).
        """
        n, d = self.right.shape
        pairs = [range(i, min(i + 2, n)) for i in range(0, n, 2)]
        below = [self._join(later, former) for former, later in pairwise(pairs)]
        inverses = [np.linalg.inv(self._join(pairs[0], pairs[0]))]
        for pair, rows in zip(pairs[1:], below, strict=True):
            inverses.append(np.linalg.inv(self._join(pair, pair) - rows @ inverses[-1] @ rows.T))
        covariance, found = inverses[-1], [inverses[-1]]
        for inverse, rows in zip(inverses[-2::-1], below[::-1], strict=True):
            gain = inverse @ rows.T
            covariance = inverse + gain @ covariance @ gain.T
            found.append(covariance)
        diagonal = [each[j : j + d, j : j + d] for each in found[::-1] for j in range(0, len(each), d)]
        return np.array(diagonal, float)

    def _join(self, rows: range, columns: range) -> Array:
        """Return the part of A of some times, rows and columns."""
        return np.block([[self._block(i, j) for j in columns] for i in rows])

    def _block(self, i: int, j: int) -> Array:
        if i < j:
            return self._block(j, i).T
        return self.blocks[i - j][j] if i - j <= 2 else np.zeros_like(self.blocks[0][0])
