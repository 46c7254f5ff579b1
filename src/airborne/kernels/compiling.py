"""The decorator of all kernels, and what makes their machine code independent of what else a process compiled.

A kernel's object code holds copies of the kernels that it calls, compiled anew among its own code. Numba leaves these
copies visible, as weak symbols, and the linker then takes one copy for all: the one that was loaded first. That is the
called kernel's own in a process that compiles, and a caller's copy in one that loads from the cache. Under fast maths
the two differ in the last digits. So a kernel here keeps its copies to itself. Numba's own helpers, as that of `x**2`,
are compiled once a process, with fast maths or without, as the kernel is that needs them first; here, once for each.
"""

from __future__ import annotations

import gc
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba import config, njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager

from airborne.kernels.borrowing import kernel_passes
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
    for these types, whichever it is called with.
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
        "no_cfunc_wrapper": True,  # no kernel is given to a library in C
    }
    compiled: Any = njit(pipeline_class=_Compiler, **options)(function)
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return compiled
    if not is_inner:
        compiled._cache = KernelCache(compiled)
    if signature is not None:

        def compile_once(*_: Any) -> Any:
            machine_code = compiled.compile(signature)
            compiled.disable_compile()
            return machine_code

        compiled._compile_for_args = compile_once  # which Numba calls for types that are not compiled yet
    return compiled


class _Library(JITCodeLibrary):
    """The machine code of one kernel, with private copies of what it calls."""

    def _finalize_final_module(self) -> None:
        shared = [f for f in self._final_module.functions if not f.is_declaration and f.linkage == _SHARED]
        for function in shared:
            function.linkage = llvm.Linkage.internal
        super()._finalize_final_module()  # here the machine code is made
        for function in shared:
            function.linkage = _SHARED  # for kernels that call this one: they need one copy of each function only

    def _get_module_for_linking(self) -> Any:
        """Return what callers copy: read back from its bytes, as it is where this kernel comes from the cache."""
        if self._shared_module is None:
            self._shared_module = llvm.parse_bitcode(super()._get_module_for_linking().as_bitcode())
        return self._shared_module


class _InnerLibrary(_Library):
    """What other kernels copy of one that only they call: no machine code is made of it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        # where Numba writes down, for every kernel, the address of its environment
        environments = [str(each) for each in self._final_module.global_variables if each.name.startswith(_ENVIRONMENT)]
        module = llvm.parse_assembly("\n".join(environments))
        module.data_layout = self._codegen._data_layout
        self._codegen._add_module(module)
        self._codegen._engine.finalize_object()  # pyright: ignore[reportCallIssue]
        self._finalized = True


_HELPERS: dict[bool, dict[Any, Any]] = defaultdict(dict)  # of Numba's own, by whether maths is fast


@contextmanager
def _own_helpers(context: Any, *, fastmath: bool) -> Iterator[None]:
    """Let a kernel share Numba's helpers with those alone whose maths is as fast."""
    callers = context.cached_internal_func
    context.cached_internal_func = _HELPERS[fastmath]
    try:
        yield
    finally:
        context.cached_internal_func = callers


_SHARED = llvm.Linkage.linkonce_odr
_ENVIRONMENT = "_ZN08NumbaEnv"


class _Compiler(Compiler):
    """Numba's compiler, with a pass and libraries of our own."""

    def define_pipelines(self) -> list[PassManager]:
        return [kernel_passes(self.state)]

    def compile_extra(self, func: Callable) -> Any:
        library = _InnerLibrary if self.state.flags.no_cpython_wrapper else _Library
        self.state.library = library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        collects = gc.isenabled()
        gc.disable()  # it would go through Numba's trees again and again: a fifth of the time
        try:
            with _own_helpers(self.state.targetctx, fastmath=bool(self.state.flags.fastmath)):
                return super().compile_extra(func)
        finally:
            if collects:
                gc.enable()
