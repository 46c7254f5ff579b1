"""The tables agreement.csv and repeatability.csv: each number with the ends of its 95 % interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from airborne.errors import ResultError
from airborne.evaluation.agreement import Agreement
from airborne.evaluation.icc import Reliability
from airborne.evaluation.repeatability import Repeatability
from airborne.io.text import read_csv
from airborne.io.writing import write_text
from airborne.motion.jumps.jump import Measurement
from airborne.motion.tables import cell

Row = dict[str, object]

_ICC = {
    "icc_1": "one_way",
    "icc_a1": "agreement",
    "icc_c1": "consistency",
    "icc_k": "one_way_mean",
    "icc_ak": "agreement_mean",
    "icc_ck": "consistency_mean",
}


def write_agreements(path: Path, agreements: Mapping[str, Sequence[Agreement]]) -> None:
    """Write agreement.csv, one row per variable and reference; empty where unknown. Other references stay."""
    _write(path, [{"against": name} | _agreement(row) for name, rows in agreements.items() for row in rows])


def write_repeatability(path: Path, repeatabilities: Mapping[str, Sequence[Repeatability]]) -> None:
    """Write repeatability.csv, one row per variable and kind of repetition; empty where unknown. Others stay."""
    _write(path, [{"between": name} | _repeatability(row) for name, rows in repeatabilities.items() for row in rows])


def _agreement(row: Agreement) -> Row:
    columns: Row = {"variable": row.name, "unit": row.unit, "n": row.n, "n_individuals": row.n_individuals}
    columns |= {"n_effective": row.n_effective} | _with_interval("bias", row.bias)
    columns |= {"between_sd": row.between_sd, "within_sd": row.within_sd}
    columns |= _with_interval("lower_limit", row.lower_limit) | _with_interval("upper_limit", row.upper_limit)
    columns |= (
        _with_interval("rmse", row.rmse) | {"range": row.range} | _with_interval("nrmse_percent", row.nrmse_percent)
    )
    return columns | _correlations(row.icc) | _with_interval("sem", row.sem) | _with_interval("mdc", row.mdc)


def _repeatability(row: Repeatability) -> Row:
    columns: Row = {"variable": row.name, "unit": row.unit, "n": row.n, "n_ways": row.n_ways}
    columns |= {"n_effective": row.n_effective} | _with_interval("within_sd", row.within_sd)
    columns |= _with_interval("coefficient", row.coefficient) | _correlations(row.icc) | _with_interval("sem", row.sem)
    columns |= _with_interval("mdc", row.mdc)
    return columns | {f"bias_{k}": bias for k, bias in enumerate(row.biases, 1)}


def _correlations(icc: Reliability) -> Row:
    row: Row = {}
    for name, field in _ICC.items():
        row |= _with_interval(name, getattr(icc, field))
    return row


def _with_interval(name: str, measured: Measurement) -> Row:
    return {name: measured.value, f"{name}_low": measured.low, f"{name}_high": measured.high}


def _write(path: Path, rows: Sequence[Row]) -> None:
    """Write rows after those that the table holds of other comparisons."""
    columns = list(rows[0])
    compared = {row[columns[0]] for row in rows}
    earlier = [row for row in _earlier_rows(path, columns) if row[0] not in compared]
    lines = [",".join(columns), *(",".join(map(_text, row)) for row in [*earlier, *(row.values() for row in rows)])]
    write_text(path, "\n".join(lines) + "\n")


def _earlier_rows(path: Path, columns: list[str]) -> list[list[str]]:
    """Return the rows of a table that has these columns; none of any other file."""
    try:
        (_, head), *rows = read_csv(path, "expected a table of agreement", ResultError)
    except (ResultError, ValueError):
        return []
    return [row for _, row in rows if len(row) == len(columns)] if head == columns else []


def _text(value: object) -> str:
    text = cell(value)
    return f'"{text}"' if "," in text else text
