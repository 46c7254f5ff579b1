"""The tables of agreement: agreement.csv and repeatability.csv, each number beside the ends of its 95 % interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from airborne.evaluation.agreement import Agreement
from airborne.evaluation.icc import Reliability
from airborne.evaluation.repeatability import Repeatability
from airborne.motion.jumps.jump import Measured
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


def write_agreements(path: Path, found: Mapping[str, Sequence[Agreement]]) -> None:
    """Write agreement.csv, one row a variable and reference; empty where unknown."""
    _write(path, [{"against": name} | _agreement(row) for name, rows in found.items() for row in rows])


def write_repeats(path: Path, found: Mapping[str, Sequence[Repeatability]]) -> None:
    """Write repeatability.csv, one row a variable and kind of repetition; empty where unknown."""
    _write(path, [{"between": name} | _repeats(row) for name, rows in found.items() for row in rows])


def _agreement(row: Agreement) -> Row:
    columns: Row = {"variable": row.name, "unit": row.unit, "n": row.n, "n_individuals": row.n_individuals}
    columns |= {"n_effective": row.n_effective} | _three("bias", row.bias)
    columns |= {"between_sd": row.between_sd, "within_sd": row.within_sd}
    columns |= _three("lower_limit", row.lower_limit) | _three("upper_limit", row.upper_limit)
    columns |= _three("rmse", row.rmse) | {"range": row.range} | _three("nrmse_percent", row.nrmse_percent)
    return columns | _correlations(row.icc) | _three("sem", row.sem) | _three("mdc", row.mdc)


def _repeats(row: Repeatability) -> Row:
    columns: Row = {"variable": row.name, "unit": row.unit, "n": row.n, "n_ways": row.n_ways}
    columns |= {"n_effective": row.n_effective} | _three("within_sd", row.within_sd)
    columns |= _three("coefficient", row.coefficient) | _correlations(row.icc) | _three("sem", row.sem)
    columns |= _three("mdc", row.mdc)
    return columns | {f"bias_{k}": bias for k, bias in enumerate(row.biases, 1)}


def _correlations(icc: Reliability) -> Row:
    found: Row = {}
    for name, field in _ICC.items():
        found |= _three(name, getattr(icc, field))
    return found


def _three(name: str, measured: Measured) -> Row:
    return {name: measured.value, f"{name}_low": measured.low, f"{name}_high": measured.high}


def _write(path: Path, rows: Sequence[Row]) -> None:
    lines = [",".join(rows[0]), *(",".join(_text(value) for value in row.values()) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _text(value: object) -> str:
    text = cell(value)
    return f'"{text}"' if "," in text else text
