"""A comparison's folder: tables, figures, and the text with its methods paragraph."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from airborne.errors import AirborneError, ResultError
from airborne.io.names import file_stem
from airborne.io.writing import write_text
from airborne.motion.run_folder import RUN_RECORD
from airborne.motion.tables import cell
from airborne.study.comparison import VariableComparison, compare_trials
from airborne.study.curves import require_events
from airborne.study.figures import write_comparison_figures
from airborne.study.spm import check_spm1d
from airborne.study.text import describe_study
from airborne.study.trials import describe_alarms, describe_twins, read_study

MEANS, DIFFERENCES, CURVES, CLUSTERS = "means.csv", "differences.csv", "curves.csv", "clusters.csv"
TEXT = "comparison.txt"


def write_comparison(
    batch: Path,
    folder: Path,
    variables: Sequence[str],
    *,
    events: Sequence[str] = ("start", "end"),
    conditions: Sequence[str] = (),
    real_time: bool = False,
) -> str:
    """Compare variables across the trials of a batch's folder, write tables, figures and text, and return the text.

    Raises AirborneError where a variable is unknown or there are too few trials, conditions or events, and for a
    folder that holds a run.
    """
    require_events(events)
    try:
        stems = [file_stem(variable) for variable in variables]
    except ValueError as error:
        raise AirborneError(f"--variable: {error}") from None
    if (folder / RUN_RECORD).is_file():
        raise ResultError(f"{folder} holds a run; give another folder (-o)")
    study = read_study(batch, conditions)
    check_spm1d()
    compared = [compare_trials(study, variable, events, real_time=real_time) for variable in variables]
    folder.mkdir(parents=True, exist_ok=True)
    _write_table(folder / MEANS, (row for each in compared for row in _means(each)))
    _write_table(folder / DIFFERENCES, (row for each in compared for row in _differences(each)))
    if any(each.axis is not None for each in compared):
        _write_table(folder / CURVES, (row for each in compared for row in _curve_rows(each)))
        _write_table(folder / CLUSTERS, (row for each in compared for row in _clusters(each)))
    for each, stem in zip(compared, stems, strict=True):
        write_comparison_figures(folder, each, stem)
    text = describe_study(compared, events, real_time=real_time, left_out=study.left_out)
    if doubts := [*describe_twins(study.trials), *describe_alarms(study.trials)]:
        text = "\n".join(["Read this first", *doubts, "", text])
    write_text(folder / TEXT, text)
    return text


def _write_table(path: Path, rows: Iterator[Mapping[str, Any]]) -> None:
    listed = list(rows)
    columns = list(dict.fromkeys(name for row in listed for name in row))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([cell(row.get(name, "")) for name in columns] for row in listed)
    write_text(path, text.getvalue())


def _means(comparison: VariableComparison) -> Iterator[dict[str, Any]]:
    """Yield each athlete's mean and sd in each condition, of a number; then all athletes' (the sd between them)."""
    if comparison.axis is not None:
        return
    cells = comparison.cells
    for k, condition in enumerate(comparison.conditions):
        means = []
        for athlete in cells.athletes_in(k).tolist():
            own = cells.values[(cells.athlete == athlete) & (cells.condition == k), 0]
            means.append(float(own.mean()))
            yield _mean_row(comparison.variable, condition, comparison.athletes[athlete], own)
        yield _mean_row(comparison.variable, condition, "all", np.array(means))


def _mean_row(variable: str, condition: str, athlete: str, values: np.ndarray) -> dict[str, Any]:
    sd = float(values.std(ddof=1)) if len(values) > 1 else np.nan
    row = {"variable": variable, "condition": condition, "athlete": athlete}
    return row | {"n": len(values), "mean": float(values.mean()), "sd": sd}


def _differences(comparison: VariableComparison) -> Iterator[dict[str, Any]]:
    """Yield the difference of each pair of conditions; of a curve that where it is largest."""
    spread = comparison.spread
    for each in comparison.contrasts:
        difference = each.difference
        k = int(np.nanargmax(np.abs(difference.value)))
        yield {
            "variable": comparison.variable,
            "a": each.a,
            "b": each.b,
            "at": np.nan if comparison.axis is None else float(comparison.axis[k]),
            "level": difference.level,
            "n_a": len(difference.samples[0]),
            "n_b": len(difference.samples[1]),
            "difference": float(difference.value[k]),
            "low": float(difference.low[k]),
            "high": float(difference.high[k]),
            "p": np.nan if each.p_holm is None else float(difference.p[k]),
            "p_holm": np.nan if each.p_holm is None else each.p_holm,
            "sd_athletes": float(difference.sd_athletes[k]),
            "sd_trials": float(spread.sd_within[k]),
            "sd_measurement": float(spread.sd_measurement[k]) or np.nan,  # 0: not stated
            "mdc": float(spread.mdc[k]),
        }


def _curve_rows(comparison: VariableComparison) -> Iterator[dict[str, Any]]:
    """Yield every node of the conditions' means of athletes, and of the differences with their intervals and t."""
    axis, cells = comparison.axis, comparison.cells
    if axis is None:
        return
    for k, condition in enumerate(comparison.conditions):
        means = np.stack([cells.mean(athlete, k) for athlete in cells.athletes_in(k)])
        sd = means.std(axis=0, ddof=1) if len(means) > 1 else np.full(len(axis), np.nan)
        for node, at in enumerate(axis.tolist()):
            yield {
                "variable": comparison.variable,
                "what": condition,
                "at": at,
                "value": float(means[:, node].mean()),
                "sd": float(sd[node]),
            }
    for each in comparison.contrasts:
        difference, test = each.difference, each.test
        assert test is not None, "a curve has a test"
        for node, at in enumerate(axis.tolist()):
            yield {
                "variable": comparison.variable,
                "what": f"{each.b} minus {each.a}",
                "at": at,
                "value": float(difference.value[node]),
                "low": float(difference.low[node]),
                "high": float(difference.high[node]),
                "t": float(test.t[node]),
            }


def _clusters(comparison: VariableComparison) -> Iterator[dict[str, Any]]:
    """Yield the stretches of a curve in which two conditions differ."""
    axis = comparison.axis
    for each in comparison.contrasts:
        if axis is None or each.test is None:
            continue
        for low, high, p in each.test.clusters:
            ends = np.interp([low, high], np.arange(len(axis)), axis)
            row = {"variable": comparison.variable, "a": each.a, "b": each.b}
            yield row | {"from": float(ends[0]), "to": float(ends[1]), "threshold": each.test.threshold, "p": p}
