"""Equations of a path, solved as a band, against the same as one dense system."""

import numpy as np
import pytest

from airborne.geometry.banded_equations import BandedEquations, JoiningRows
from tests.support.tolerances import ROUNDTRIP


@pytest.mark.parametrize(("n", "d"), [(3, 2), (4, 6), (7, 4)])
def test_band_is_solved_as_one_dense_system(n, d):
    rng = np.random.default_rng(n)
    root = rng.normal(size=(n, d, d))
    own, right = root @ root.swapaxes(1, 2) + np.eye(d), rng.normal(size=(n, d))
    joining = [
        JoiningRows(rng.normal(size=(n - 2, d // w, k, 3, w)), rng.normal(size=(n - 2, d // w, k)))
        for w, k in ((d, 2), (d // 2, 3))
    ]
    A, b = np.zeros((n, d, n, d)), right.copy()
    A[range(n), :, range(n)] = own
    for each in joining:
        for i in range(n - 2):
            for group, (by_change, values) in enumerate(zip(each.by_change[i], each.values[i], strict=True)):
                w = by_change.shape[-1]
                rows = np.zeros((len(values), n, d))
                rows[:, i : i + 3, group * w : (group + 1) * w] = by_change
                A += np.einsum("kia,kjb->iajb", rows, rows)
                b -= np.einsum("kia,k->ia", rows, values)
    expected = np.linalg.solve(A.reshape(n * d, n * d), b.ravel()).reshape(n, d)
    equations = BandedEquations.of(own, right, *joining)
    np.testing.assert_allclose(equations.solve(), expected, rtol=ROUNDTRIP, atol=ROUNDTRIP)
    np.testing.assert_allclose(equations.right, b, rtol=ROUNDTRIP, atol=ROUNDTRIP)
    inverse = np.linalg.inv(A.reshape(n * d, n * d)).reshape(n, d, n, d)
    np.testing.assert_allclose(equations.covariances(), inverse[range(n), :, range(n)], rtol=ROUNDTRIP, atol=ROUNDTRIP)
    rights = rng.normal(size=(n, d, 2))
    expected = np.einsum("iajb,jbk->iak", inverse, rights)
    np.testing.assert_allclose(equations.solve(rights), expected, rtol=ROUNDTRIP, atol=ROUNDTRIP)
