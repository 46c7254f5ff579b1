"""Normal equations of the segments' twists: summed over pixels here, then mapped to a body's degrees of freedom.

A twist (6,) is a translation [m] and a rotation vector in world axes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from airborne.kernels import kernel

BLOCK_PX = 16  # residuals this close are correlated: the side of a block of the covariance's sandwich


class Sums(NamedTuple):
    """Normal equations of the twist (6,) of each of s segments, summed over pixels: A twist = g.

    A pixel belongs to one segment, so only the chain of joints couples two of them: see `map_equations`.
    """

    A: Any  # (s, 6, 6) curvature
    g: Any  # (s, 6) gradient
    B: Any  # (s, 6, 3) change of g by an image shifted right or down by a pixel, or an outline a pixel wider

    @classmethod
    def zero(cls, n_segments: int) -> Sums:
        """Return sums of zero."""
        return cls(np.zeros((n_segments, 6, 6)), np.zeros((n_segments, 6)), np.zeros((n_segments, 6, 3)))


def new_blocks(width: int, height: int, n_segments: int) -> np.ndarray:
    """Allocate the gradients of each block of an image, segment by segment: (rows, columns, s, 6)."""
    return np.zeros((height // BLOCK_PX + 1, width // BLOCK_PX + 1, n_segments, 6))


def one_block(n_segments: int) -> np.ndarray:
    """Allocate the gradients of a whole image, as `new_blocks`, where no covariance will be asked for."""
    return np.zeros((1, 1, n_segments, 6))


def merge_blocks(blocks: np.ndarray, n: int) -> np.ndarray:
    """Sum the blocks (rows, columns, s, 6) that hold any gradient into at most n by n patches: (k, m, s, 6)."""
    for axis in (0, 1):
        used = np.flatnonzero(np.any(blocks != 0, axis=(1 - axis, 2, 3)))
        if len(used) == 0:
            return blocks
        first, end = used[0], used[-1] + 1
        blocks = np.add.reduceat(blocks, np.arange(first, end, -(-(end - first) // n)), axis=axis)
    return blocks


@kernel(fastmath=True)
def map_equations(A, g, jacobians, H, gradient):
    """Add the segments' equations, A (s, 6, 6) and g (s, 6), mapped by the jacobians (s, 6, d), to H (d, d) and (d,).

    Segments without visible pixels are skipped, and so are degrees of freedom that do not move a segment.
    """
    d = len(gradient)
    for e in range(len(A)):
        J = jacobians[e]
        if A[e, 0, 0] == 0 and A[e, 1, 1] == 0 and A[e, 2, 2] == 0:
            continue
        AJ = np.zeros((6, d))
        moves = np.zeros(d, np.bool_)
        for i in range(d):
            for p in range(6):
                if J[p, i] != 0:
                    moves[i] = True
        for i in range(d):
            if moves[i]:
                for p in range(6):
                    gradient[i] += J[p, i] * g[e, p]
                    for q in range(6):
                        AJ[p, i] += A[e, p, q] * J[q, i]
        for i in range(d):
            if moves[i]:
                for j in range(d):
                    if moves[j]:
                        for p in range(6):
                            H[i, j] += J[p, i] * AJ[p, j]


@kernel(fastmath=True)
def add_score_covariance(blocks, jacobians, S):
    """Add to S (d, d) the sum of G G' over the blocks (n, s, 6), G a block's gradient mapped by jacobians (s, 6, d)."""
    d = len(S)
    G = np.empty(d)
    for n in range(len(blocks)):
        G[:] = 0
        is_empty = True
        for e in range(blocks.shape[1]):
            for p in range(6):
                value = blocks[n, e, p]
                if value != 0:
                    is_empty = False
                    for i in range(d):
                        G[i] += value * jacobians[e, p, i]
        if not is_empty:
            for i in range(d):
                for j in range(d):
                    S[i, j] += G[i] * G[j]
