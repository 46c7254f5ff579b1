"""After `airborne warm` the first run compiles nothing."""

import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from itertools import product
from multiprocessing import get_context

from numba.core.dispatcher import Dispatcher

from airborne.appearance import light_planes
from airborne.appearance.brightness import _count_ratios
from airborne.motion.smoothing import state_space
from airborne.run import warm
from airborne.run.warm import read_images, smooth_a_path
from airborne.video import crops
from tests.support.commands import in_process


def loaded_kernels():
    """Return which kernels this process has loaded or compiled, for which types."""
    modules = [module for name, module in sys.modules.items() if name.startswith("airborne.")]
    kernels = [each for module in modules for each in vars(module).values() if isinstance(each, Dispatcher)]
    return {(kernel.py_func.__qualname__, types) for kernel in kernels for types in kernel.signatures}


def warm_and_track(trial, folder):
    """Warm the kernels in this process, then track a trial; return which more that took."""
    warm.ProcessPoolExecutor = lambda *_: ThreadPoolExecutor(1)
    assert in_process("warm") == 0
    warmed = loaded_kernels()
    assert in_process("track", trial, "-o", folder) == 0
    return sorted(name for name, _ in loaded_kernels() - warmed)


def test_what_was_warmed_compiles_nothing(thrown_cross, tmp_path):
    """That processes can share the work is seen where a fresh clone is tested: its kernels are warmed first."""
    with ProcessPoolExecutor(1, get_context("spawn")) as fresh:
        assert fresh.submit(warm_and_track, thrown_cross / "trial.toml", tmp_path / "run").result() == []


def test_whole_images_and_parts_are_read_as_all_types_that_occur():
    read_images()
    smooth_a_path()
    planes = {(str(image.dtype), image.layout) for image, *_ in light_planes.signatures}
    assert planes >= set(product(("uint8", "float32"), "AC"))
    assert {(image.layout, known.layout) for image, known, *_ in _count_ratios.signatures} >= set(product("AC", "AC"))
    assert all(kernel.signatures for kernel in (crops._convert, state_space._filter_kernel))
