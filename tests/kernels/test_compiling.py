"""What a compilation leaves as it was, and that what was compiled before does not change it."""

import gc
import re
from collections import defaultdict

import pytest

from airborne.kernels import compiling, kernel


@kernel(is_inner=True)
def _double(x):
    return 2 * x


@kernel
def _quadruple(x):
    return _double(_double(x))


def _square(x):
    return x**2


@pytest.mark.parametrize("order", [(True, False), (False, True)], ids=["the fast one first", "the exact one first"])
def test_maths_is_fast_in_the_kernels_alone_that_ask_for_it(order, monkeypatch):
    """Numba's helper for powers is compiled for the first kernel that needs it."""
    monkeypatch.setattr(compiling, "_HELPERS", defaultdict(dict))
    kernels = {is_fast: kernel(_square, fastmath=is_fast) for is_fast in order}
    for is_fast, each in kernels.items():
        each._cache.disable()
        assert each(3.0) == 9.0
        machine_code = each.overloads[each.signatures[0]].library.get_llvm_str()
        assert set(re.findall(r"fmul( fast)? double", machine_code)) == {" fast" if is_fast else ""}


def test_kernel_that_calls_an_inner_one_compiles_and_leaves_the_collector_of_garbage_on_or_off():
    try:
        for is_on, value in ((True, 3), (False, 0.5)):  # compiled for each type
            (gc.enable if is_on else gc.disable)()
            assert _quadruple(value) == 4 * value
            assert gc.isenabled() == is_on
    finally:
        gc.enable()
