"""Tables as Parquet files; *pyarrow*, which writes them, is large and optional (`pip install pyarrow`)."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from airborne.io.writing import explain_full_disk

CAN_WRITE_PARQUET = find_spec("pyarrow") is not None


def write_parquet(
    path: Path, columns: Mapping[str, Any], units: Mapping[str, str], conventions: dict[str, str]
) -> None:
    """Write columns, each (rows,), units (by name, else "1") and conventions in the metadata; NaN is null.

    Needs `CAN_WRITE_PARQUET`.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [_arrow_array(column) for column in columns.values()]
    fields = [
        pa.field(name, array.type, metadata={"units": units.get(name, "1")})
        for name, array in zip(columns, arrays, strict=True)
    ]
    with explain_full_disk(path):
        pq.write_table(pa.table(arrays, schema=pa.schema(fields, metadata=conventions)), path)


def _arrow_array(column: Any) -> Any:
    """Return a column (rows,) as Arrow's, NaN as null; of numbers and texts its bytes, as `pa.array` loads pandas."""
    import pyarrow as pa

    kind = column.dtype.kind if isinstance(column, np.ndarray) else ""
    if kind == "U":
        texts = [text.encode() for text in column.tolist()]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
        return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(texts)))
    if kind not in ("i", "f"):
        return pa.array(column, from_pandas=True)
    is_known = ~np.isnan(column)
    known = None if is_known.all() else pa.py_buffer(np.packbits(is_known, bitorder="little"))
    values = pa.py_buffer(np.ascontiguousarray(column))
    return pa.Array.from_buffers(pa.from_numpy_dtype(column.dtype), len(column), [known, values])
