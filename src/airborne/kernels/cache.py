"""Compiled kernels on disk: one file for each kernel and types of arguments, named after what it was compiled from.

They lie in `__pycache__` beside the source, or where that cannot be written, in the user's cache folder; in the folder
NUMBA_CACHE_DIR where that is set. A file is written under another name first, so that a run that is killed leaves
nothing half done. Files of code that is no more go when the next kernel of their module is saved.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import pickle
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

from numba import config
from numba.core.caching import UserProvidedCacheLocator, _Cache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.misc.appdirs import AppDirs

from airborne.kernels.digest import digest_of

_LOG = logging.getLogger(__name__)
_PYTHON = f"py{sys.version_info.major}{sys.version_info.minor}"
_KERNELS_OF: dict[Path, list[Dispatcher]] = defaultdict(list)  # by source file


class KernelCache(_Cache):
    """What was compiled of one kernel, as Numba's dispatchers ask for it."""

    def __init__(self, kernel: Dispatcher):
        self._kernel = kernel
        self._source = Path(kernel.py_func.__code__.co_filename)
        self._is_enabled = True
        _KERNELS_OF[self._source].append(kernel)

    @property
    def cache_path(self) -> str | None:
        """The folder; none where no folder can be written."""
        folder = _folder(self._source.parent, config.CACHE_DIR)  # type: ignore[attr-defined]
        return None if folder is None else str(folder)

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """Load the code for these types of arguments; none where there is none, or it cannot be read."""
        rtsys.initialize(target_context)  # all that code from a file needs; to compile, Numba imports far more
        path = self._path(sig, target_context.codegen())
        if path is None:
            return None
        try:
            payload = pickle.loads(path.read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            _say_that_it_compiles()
            return None
        return CompileResult._rebuild(target_context, *payload)

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Save the code for these types of arguments; a full disk or a lost folder costs time at the next run only."""
        path = self._path(sig, data.codegen)
        if path is None or any(not part.can_cache for part in data.lifted) or data.library.has_dynamic_globals:
            return
        try:
            _drop_old(self._source, path.parent)
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix=path.name, suffix=".part", delete=False) as file:
                file.write(dumps(data._reduce()))
            os.replace(file.name, path)
        except OSError:
            return

    def enable(self) -> None:
        """Load and save from now on."""
        self._is_enabled = True

    def disable(self) -> None:
        """Neither load nor save from now on."""
        self._is_enabled = False

    def flush(self) -> None:
        """Delete what is cached of this kernel as it now is."""
        if self.cache_path is not None:
            for path in Path(self.cache_path).glob(f"{_stem(self._kernel)}-*.nbc"):
                path.unlink(missing_ok=True)

    def _path(self, sig: Any, codegen: Any) -> Path | None:
        if not self._is_enabled or self.cache_path is None:
            return None
        key = repr((normalize_signature(sig), codegen.magic_tuple()))  # types, and the processor
        return Path(self.cache_path, f"{_stem(self._kernel)}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.nbc")


@functools.cache
def _say_that_it_compiles() -> None:
    """Log it, once a process."""
    _LOG.info("compiling what this command needs for this processor: up to a minute or two, once")


def _stem(kernel: Dispatcher) -> str:
    """Return how the names of a kernel's files begin: module.function-python-digest."""
    function: Any = kernel.py_func
    name = function.__qualname__.replace("<", "").replace(">", "")
    return f"{Path(function.__code__.co_filename).stem}.{name}-{_PYTHON}-{digest_of(kernel)}"


@functools.cache
def _folder(source: Path, chosen: str) -> Path | None:
    """Return the first folder that can be written for kernels of a source folder."""
    below = UserProvidedCacheLocator.get_suitable_cache_subpath(str(source / "kernel.py"))
    if chosen:
        folders = [Path(chosen, below)]
    else:
        folders = [source / "__pycache__", Path(AppDirs("airborne", appauthor=False).user_cache_dir, "kernels", below)]
    for folder in folders:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return folder
    return None


@functools.cache
def _drop_old(source: Path, folder: Path) -> None:
    """Delete the files of a module's former kernels, once a process; those of another Python stay."""
    kept = {_stem(kernel) for kernel in _KERNELS_OF[source]}
    for path in [*folder.glob(f"{source.stem}.*.nb[ci]"), *folder.glob(f"{source.stem}.*.part")]:
        parts = path.name.split("-")
        is_other_python = len(parts) == 4 and parts[1] != _PYTHON
        if not is_other_python and "-".join(parts[:3]) not in kept:
            path.unlink(missing_ok=True)
