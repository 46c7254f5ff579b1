"""What a compilation leaves as it was."""

import gc

from airborne.kernels import kernel


@kernel(is_inner=True)
def _double(x):
    return 2 * x


@kernel
def _quadruple(x):
    return _double(_double(x))


def test_kernel_that_calls_an_inner_one_compiles_and_leaves_the_collector_of_garbage_on_or_off():
    try:
        for is_on, value in ((True, 3), (False, 0.5)):  # compiled for each type
            (gc.enable if is_on else gc.disable)()
            assert _quadruple(value) == 4 * value
            assert gc.isenabled() == is_on
    finally:
        gc.enable()
