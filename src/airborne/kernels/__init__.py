"""Functions that are compiled to machine code: decorated with `kernel`, compiled at their first call, then cached.

In go plain functions of arrays, out come the same functions, fast. The cache is never stale (`cache.py`, `digest.py`),
and a kernel gives the same bytes whether it was just compiled or loaded (`compiling.py`). Kernels that own no array
count no references (`borrowing.py`). Where kernels run, memory is kept from frame to frame (`memory.py`). Knows
nothing of bodies.
"""

from airborne.kernels.compiling import kernel
from airborne.kernels.memory import keep_freed_memory

__all__ = ["kernel"]

keep_freed_memory()
