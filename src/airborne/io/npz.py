"""`.npz` files, read with care: no pickles, and a limit on size whatever the file declares."""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

from numpy.lib import format as npy
from numpy.typing import NDArray

from airborne.io.text import read_bytes

_MOST_BYTES = 256_000_000  # of an unpacked archive

_BROKEN = (zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, EOFError, KeyError, TypeError)
_BROKEN += (NotImplementedError, RuntimeError, SyntaxError, MemoryError, OverflowError, AssertionError)


def read_arrays(path: Path) -> dict[str, NDArray]:
    """Return a file's arrays by name. Raises ValueError for anything but a `.npz` of numbers, OSError if unreadable."""
    try:
        with zipfile.ZipFile(io.BytesIO(read_bytes(path, _MOST_BYTES))) as archive:
            members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
            if sum(member.file_size for member in members) > _MOST_BYTES:
                raise ValueError(f"its arrays take more than {_MOST_BYTES // 1_000_000} MB")
            return {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}
    except _BROKEN as error:
        raise ValueError(str(error)[:120]) from None


def write_arrays(path: Path, arrays: Mapping[str, NDArray]) -> None:
    """Write arrays by name, whatever the names are (`np.savez` reserves some for itself)."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                npy.write_array(file, values, allow_pickle=False)


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray:
    with archive.open(member) as file:
        version = npy.read_magic(file)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, dtype = read(file)
    if dtype.hasobject or math.prod(shape) * dtype.itemsize > member.file_size:
        raise ValueError(f"{member.filename} holds objects, or declares more numbers than it has")
    with archive.open(member) as file:
        return npy.read_array(file, allow_pickle=False)
