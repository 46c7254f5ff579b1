"""Equations of a path, solved as a band, against the same as one dense system."""

import numpy as np
import pytest

from airborne.geometry.banded_equations import BandedEquations, JoiningRows
from tests.support.tolerances import ROUNDTRIP


@pytest.mark.parametrize(("n", "d"), [(3, 1), (4, 3), (7, 2)])
def test_band_is_solved_as_one_dense_system(n, d):
    rng = np.random.default_rng(n)
    root = rng.normal(size=(n, d, d))
    own, right = root @ root.swapaxes(1, 2) + np.eye(d), rng.normal(size=(n, d))
    joining = [JoiningRows(rng.normal(size=(n - 2, k, 3, d)), rng.normal(size=(n - 2, k))) for k in (d, 2)]
    A, b = np.zeros((n, d, n, d)), right.copy()
    A[range(n), :, range(n)] = own
    for each in joining:
        for i in range(n - 2):
            rows = np.zeros((each.values.shape[1], n, d))
            rows[:, i : i + 3] = each.by_change[i]
            A += np.einsum("kia,kjb->iajb", rows, rows)
            b -= np.einsum("kia,k->ia", rows, each.values[i])
    expected = np.linalg.solve(A.reshape(n * d, n * d), b.ravel()).reshape(n, d)
    equations = BandedEquations.of(own, right, *joining)
    np.testing.assert_allclose(equations.solve(), expected, rtol=ROUNDTRIP, atol=ROUNDTRIP)
    np.testing.assert_allclose(equations.right, b, rtol=ROUNDTRIP, atol=ROUNDTRIP)
