"""What a kernel was compiled from, as one short text: its own code, the kernels that it calls, the constants it reads.

Numba compiles the values of global names in. So the digest follows these names, to whatever file they lead.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import platform
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, NamedTuple

import llvmlite
import numba
import numpy as np
from numba.core.dispatcher import Dispatcher

_HOW = b"".join(Path(__file__).with_name(name).read_bytes() for name in ("compiling.py", "borrowing.py"))
_TOOLS = (platform.python_version(), numba.__version__, llvmlite.__version__, hashlib.sha256(_HOW).hexdigest())


@functools.cache
def digest_of(kernel: Dispatcher) -> str:
    """Return 16 letters and digits that change with anything that the kernel's machine code is made from."""
    found = {kernel: None}  # in the order in which they are met
    waiting = [kernel]
    while waiting:
        new = [called for called in _read(waiting.pop()).called if called not in found]
        found.update(dict.fromkeys(new))
        waiting += new
    return hashlib.sha256("\n".join([repr(_TOOLS), *(_read(each).text for each in found)]).encode()).hexdigest()[:16]


class _Reading(NamedTuple):
    """What one kernel is by itself, and the kernels that it calls."""

    text: str
    called: list[Dispatcher]


@functools.cache
def _read(kernel: Dispatcher) -> _Reading:
    function: Any = kernel.py_func
    parts = [f"{function.__module__}.{function.__qualname__}", repr(sorted(kernel.targetoptions.items()))]
    parts.append(repr(function.__defaults__))
    _describe_code(function.__code__, parts)
    called = []
    for key in sorted(_names_in(function.__code__) & function.__globals__.keys()):
        parts.append(key)
        if not _describe_value(function.__globals__[key], parts, called) and _is_global(function.__code__, key):
            raise TypeError(f"the kernel {parts[0]} reads {key}: import the constant or the kernel itself by its name")
    for cell in function.__closure__ or ():
        _describe_value(cell.cell_contents, parts, called)
    return _Reading("\n".join(parts), called)


def _describe_code(code: CodeType, parts: list[str]) -> None:
    parts += [code.co_code.hex(), repr((code.co_names, code.co_varnames, code.co_freevars, code.co_exceptiontable))]
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            _describe_code(constant, parts)
        else:
            parts.append(repr(sorted(constant) if isinstance(constant, frozenset) else constant))


def _names_in(code: CodeType) -> set[str]:
    """Return the global names that a code reads, and the names of attributes, which do no harm here."""
    return {*code.co_names}.union(*(_names_in(inside) for inside in code.co_consts if isinstance(inside, CodeType)))


def _is_global(code: CodeType, name: str) -> bool:
    inside = [constant for constant in code.co_consts if isinstance(constant, CodeType)]
    steps = [step for part in (code, *inside) for step in dis.get_instructions(part)]
    return any(step.opname == "LOAD_GLOBAL" and step.argval == name for step in steps)


def _describe_value(value: Any, parts: list[str], called: list[Dispatcher]) -> bool:
    """Add a value that a kernel reads to `parts`, or a kernel to `called`; False where it is nothing of the kind."""
    if isinstance(value, Dispatcher):
        called.append(value)
    elif isinstance(value, np.ndarray):
        parts += [f"{value.dtype.str} {value.shape}", value.tobytes().hex()]
    elif isinstance(value, tuple):
        parts.append(f"{type(value).__qualname__} {len(value)}")
        return all([_describe_value(entry, parts, called) for entry in value])
    elif isinstance(value, bool | int | float | str | np.generic) or value is None:
        parts.append(f"{type(value).__name__} {value!r}")
    elif isinstance(value, ModuleType) and not _is_ours(value.__name__):
        parts.append(value.__name__)
    elif hasattr(value, "_fields") or (hasattr(value, "__name__") and not _is_ours(getattr(value, "__module__", ""))):
        parts.append(f"{getattr(value, '__module__', '')}.{value.__name__} {getattr(value, '_fields', '')}")
    else:
        return False
    return True


def _is_ours(module: str | None) -> bool:
    return (module or "").split(".")[0] == "airborne"
