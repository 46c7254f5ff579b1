"""Kernels that only borrow their arrays do not count references.

Numba counts the references to every array that a function takes out of a tuple, slices or hands on, by a locked
addition: 6 ns each, and most of the time of a kernel that calls others in its inner loop. A kernel that allocates no
array and returns none has nothing to free: its callers hold all that it touches for as long as it runs.
"""

from __future__ import annotations

from typing import Any

from numba.core import ir, types
from numba.core.compiler import DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, PassManager, register_pass
from numba.core.typed_passes import AnnotateTypes

# steps of Numba's that make no array of their own
_VIEWS = {"getattr", "static_getitem", "cast", "exhaust_iter", "build_tuple", "phi"}
_VIEWS |= {"getiter", "iternext", "pair_first", "pair_second", "null"}


@register_pass(mutates_CFG=False, analysis_only=True)
class CountReferences(AnalysisPass):
    """Turn the counting of references off for a kernel that owns no array."""

    _name = "count_references"

    def __init__(self) -> None:
        AnalysisPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Decide for one kernel whose types are known; nothing of its code changes."""
        if not (_is_counted(state, state.return_type) or any(_owns(state, step) for step in _steps(state))):
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
        return False


def kernel_passes(state: Any) -> PassManager:
    """Return the passes that compile a kernel."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)
    passes.add_pass_after(CountReferences, AnnotateTypes)
    passes.finalize()
    return passes


def _steps(state: Any) -> list[ir.Assign]:
    return [step for block in state.func_ir.blocks.values() for step in block.find_insts(ir.Assign)]


def _is_counted(state: Any, kind: types.Type) -> bool:
    """Whether values of a type hold references that are counted."""
    return state.targetctx.data_model_manager[kind].contains_nrt_meminfo()


def _owns(state: Any, step: ir.Assign) -> bool:
    """Whether a step may make something that has to be freed."""
    value = step.value
    if not isinstance(value, ir.Expr) or not _is_counted(state, state.typemap[step.target.name]):
        return False
    if value.op == "call":
        return not isinstance(state.typemap[value.func.name], types.NamedTupleClass)
    if value.op == "getitem":  # by a number or a slice it is a view, by an array a copy
        return _is_counted(state, state.typemap[value.index.name])
    return value.op not in _VIEWS
