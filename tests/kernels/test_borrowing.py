"""References are counted where a kernel owns arrays, and nowhere else; nothing leaks, nothing is freed too early."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from airborne.kernels import kernel


class _Pair(NamedTuple):
    first: Any
    second: Any


@kernel
def _sum_of_views(pair, n):
    total = 0.0
    for i in range(n):
        row = pair.first[i % len(pair.first)]
        both = _Pair(row[1:], pair.second)
        total += both.first[0] + both.second[0]
    return total


@kernel
def _sum_of_copies(values, indices, n):
    total = 0.0
    for _ in range(n):
        total += values[indices][0]
    return total


@kernel
def _sum_of_products(values, n):
    total = 0.0
    for _ in range(n):
        total += (values * values)[0]
    return total


@kernel
def _allocate(n):
    return np.ones(n)


@kernel
def _sum_of_allocated(n):
    return _allocate(n).sum()


@kernel
def _second_row(values):
    return values[1]


@kernel
def _swap(pair):
    return _Pair(pair.second, pair.first)


VALUES, INDICES = np.arange(6.0).reshape(2, 3), np.array([2, 0])
OWNERS = (
    (_sum_of_copies, (VALUES[0], INDICES, 50)),
    (_sum_of_products, (VALUES[1], 50)),
    (_sum_of_allocated, (50,)),
    (_second_row, (VALUES,)),
    (_swap, (_Pair(VALUES, INDICES),)),
)


def _compile_anew(function):
    """A kernel that is not taken from the cache, which does not tell whether references are counted."""
    fresh = kernel(function.py_func)
    fresh._cache.load_overload = lambda *_: None
    return fresh


def _counts(compiled):
    """Whether a kernel, compiled for each of its types, counts references."""
    return {result.target_context.enable_nrt for result in compiled.overloads.values()}


def test_kernel_that_only_slices_and_packs_what_it_is_given_counts_no_references():
    assert _sum_of_views(_Pair(VALUES, INDICES.astype(float)), 4) == 1 + 4 + 1 + 4 + 4 * 2
    fresh = _compile_anew(_sum_of_views)
    fresh(_Pair(VALUES, INDICES.astype(float)), 4)
    assert _counts(fresh) == {False}


@pytest.mark.parametrize(("owner", "arguments"), OWNERS, ids=lambda each: getattr(each, "__name__", ""))
def test_kernel_that_makes_or_returns_an_array_counts_references_and_frees_what_it_made(owner, arguments):
    fresh = _compile_anew(owner)
    fresh(*arguments)
    assert _counts(fresh) == {True}
    _nrt_python.memsys_enable_stats()
    try:
        before = rtsys.get_allocation_stats()
        for _ in range(20):
            fresh(*arguments)
        after = rtsys.get_allocation_stats()
    finally:
        _nrt_python.memsys_disable_stats()
    assert after.alloc - before.alloc == after.free - before.free
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free > 0


def test_array_that_a_kernel_returns_outlives_what_it_is_a_view_of():
    values = np.arange(20000.0).reshape(2, -1)
    row = _second_row(values)
    del values
    assert np.array_equal(row, np.arange(10000.0, 20000.0))
