"""The decorator of all kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import config, njit

from airborne.kernels.cache import KernelCache


def kernel(
    function: Callable | None = None,
    *,
    fastmath: bool = False,
    inline: str = "never",
    is_inner: bool = False,
    signature: str | None = None,
) -> Any:
    """Compile a function of arrays at its first call; it lets go of Python's lock and divides as NumPy does.

    `fastmath` lets sums change their order, `inline="always"` copies the function into the kernels that call it. What
    `is_inner` is called by kernels only, and cached only as a part of them. With a `signature` the function is compiled
    for these types, and when it is imported.
    """
    if function is None:
        return lambda f: kernel(f, fastmath=fastmath, inline=inline, is_inner=is_inner, signature=signature)
    # every option is set: what is not, Numba takes over from the kernel that happens to call it first
    options = {
        "nogil": True,
        "error_model": "numpy",
        "fastmath": fastmath,
        "forceinline": False,
        "inline": inline,
        "no_cpython_wrapper": is_inner,
        "no_cfunc_wrapper": is_inner,
    }
    compiled: Any = njit(**options)(function)
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return compiled
    if not is_inner:
        compiled._cache = KernelCache(compiled)
    if signature is not None:
        compiled.compile(signature)
        compiled.disable_compile()
    return compiled
