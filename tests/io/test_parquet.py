"""Columns are handed to Arrow as bytes, because its own way from arrays loads pandas: the same arrays come out."""

import subprocess
import sys

import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")

from airborne.io.parquet import _arrow_array  # noqa: E402

COLUMNS = [
    np.array([1.0, np.nan, -0.0, np.inf]),
    np.array([np.nan] * 9),
    np.arange(20.0)[::2],
    np.array([1.5, np.nan], np.float32),
    np.arange(5),
    np.array([], float),
    np.array([], np.str_),
    np.array(["tracked", "", "größer", "日本"]),
    np.array([True, False]),
    ["a", None],
]


@pytest.mark.parametrize("column", COLUMNS, ids=str)
def test_a_column_is_the_array_that_arrow_makes_of_it(column):
    array, expected = _arrow_array(column), pa.array(column, from_pandas=True)
    array.validate(full=True)
    assert array.equals(expected) and array.type == expected.type and array.null_count == expected.null_count


def test_writing_a_table_of_numbers_and_texts_loads_no_pandas(tmp_path):
    code = (
        "import sys, numpy as np; from pathlib import Path; from airborne.io.parquet import write_parquet;"
        "write_parquet(Path(sys.argv[1]), {'a': np.array([1.0, np.nan]), 'b': np.array(['x', 'y'])}, {}, {});"
        "assert 'pandas' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "table.parquet")], check=True)
