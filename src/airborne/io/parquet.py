"""Tables as Parquet files; *pyarrow*, which writes them, is large and optional (`pip install pyarrow`)."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

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

    arrays = [pa.array(column, from_pandas=True) for column in columns.values()]  # NaN becomes null
    fields = [
        pa.field(name, array.type, metadata={"units": units.get(name, "1")})
        for name, array in zip(columns, arrays, strict=True)
    ]
    with explain_full_disk(path):
        pq.write_table(pa.table(arrays, schema=pa.schema(fields, metadata=conventions)), path)
