"""One variable compared across trials: means, spreads, differences of all pairs of conditions, tests of curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import combinations

import numpy as np

from airborne.errors import ResultError
from airborne.export.page import label
from airborne.study.curves import (
    NODES,
    RunCurve,
    describe_curves,
    event_times,
    list_curves,
    normalise_time,
    read_curve,
    sample,
)
from airborne.study.random_effects import Cells, Difference, Spread, estimate_difference, within_spread
from airborne.study.spm import CurveTest, compare_curves
from airborne.study.trials import Study, StudyTrial
from airborne.types import Array

ALPHA = 0.05  # of all pairs of conditions together


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contrast:
    """Condition B minus condition A."""

    a: str
    b: str
    difference: Difference
    p_holm: float | None  # of a number: of all pairs together (Holm 1979); None for a curve
    test: CurveTest | None  # of a curve


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VariableComparison:
    """A variable of a study: a number of each trial, or a curve."""

    variable: str
    axis: Array | None  # (nodes,) of a curve: percent, or s; None of a number
    axis_label: str
    athletes: tuple[str, ...]
    conditions: tuple[str, ...]
    cells: Cells
    spread: Spread
    contrasts: tuple[Contrast, ...]
    left_out: tuple[str, ...]

    @property
    def title(self) -> str:
        """The variable in words, with its unit."""
        return label(self.variable)


def compare_trials(
    study: Study, variable: str, events: Sequence[str], *, real_time: bool = False
) -> VariableComparison:
    """Compare a column of the batch's table, or a curve of the runs between events, across conditions.

    Normalised, each stretch from event to event takes 100 %; in real time, seconds since the first event, as far as
    the shortest trial goes. Trials that lack it are left out. Raises ResultError where too few are left.
    """
    if variable in study.columns:
        return _compare_numbers(study, variable)
    curves, left_out = [], []
    for trial in study.trials:
        try:
            curve = read_curve(trial, variable)
            curves.append((trial, curve, event_times(trial, curve, events)))
        except ResultError as error:
            left_out.append(str(error))
    if not curves:
        known = [*study.columns, *(name for trial in study.trials for name in list_curves(trial))]
        if variable in known:
            raise ResultError(f"{variable}: it can be compared in no trial; the first: {left_out[0]}")
        alike = "".join(f", did you mean {name}?" for name in get_close_matches(variable, known, 1))
        raise ResultError(
            f"{variable} is no number or curve of these trials{alike or ';'} numbers: {', '.join(study.columns)}; "
            f"{describe_curves(study.trials[0])}"
        )
    axis, sampled = _sample_all([each[1:] for each in curves], real_time=real_time)
    name = "time [s]" if real_time else f"{' to '.join(events)} [%]"
    values, variances = np.stack([each[0] for each in sampled]), np.stack([each[1] for each in sampled])
    trials = [each[0] for each in curves]
    return _compare(study, trials, variable, values, variances, axis=axis, axis_label=name, left_out=left_out)


def _sample_all(
    curves: Sequence[tuple[RunCurve, list[float]]], *, real_time: bool
) -> tuple[Array, list[tuple[Array, Array]]]:
    """Return the common axis, and each curve with its variance on it."""
    if not real_time:
        n = len(curves[0][1]) - 1
        return np.linspace(0, 100 * n, NODES * n + 1), [normalise_time(curve, times) for curve, times in curves]
    shortest_s = min(times[-1] - times[0] for _, times in curves)
    period_s = float(np.median([np.median(np.diff(curve.time_s)) for curve, _ in curves]))
    axis = np.arange(0, shortest_s + period_s / 1e6, period_s)
    return axis, [sample(curve, times[0] + axis) for curve, times in curves]


def _compare_numbers(study: Study, variable: str) -> VariableComparison:
    trials = [trial for trial in study.trials if trial.require_number(variable) is not None]
    left_out = [f"{trial.name}: no {variable}" for trial in study.trials if trial not in trials]
    values = np.array([[trial.number(variable)] for trial in trials], float)
    sd = np.array([[trial.require_number(f"{variable}_sd") or 0.0] for trial in trials])
    return _compare(study, trials, variable, values, sd**2, axis=None, axis_label="", left_out=left_out)


def _compare(
    study: Study,
    trials: Sequence[StudyTrial],
    variable: str,
    values: Array,
    variances: Array,
    *,
    axis: Array | None,
    axis_label: str,
    left_out: Sequence[str],
) -> VariableComparison:
    athletes = tuple(dict.fromkeys(trial.athlete for trial in trials))
    present = {trial.condition for trial in trials}
    conditions = tuple(name for name in study.conditions if name in present)
    if len(conditions) < 2:
        without = f"; left out: {'; '.join(left_out)}"[:400] if left_out else ""
        raise ResultError(
            f"{variable}: all trials that have it are of condition {', '.join(conditions)}; give two or more to compare"
            f"{without}"
        )
    cells = Cells(
        values=values,
        variance=np.where(np.isfinite(variances), variances, 0.0),
        athlete=np.array([athletes.index(trial.athlete) for trial in trials]),
        condition=np.array([conditions.index(trial.condition) for trial in trials]),
    )
    pairs = list(combinations(range(len(conditions)), 2))
    differences = [estimate_difference(cells, a, b) for a, b in pairs]
    is_number = axis is None
    adjusted = adjust_holm([float(each.p[0]) for each in differences]) if is_number else [None] * len(pairs)
    tests = [None if is_number else compare_curves(each, ALPHA / len(pairs)) for each in differences]
    return VariableComparison(
        variable=variable,
        axis=axis,
        axis_label=axis_label,
        athletes=athletes,
        conditions=conditions,
        cells=cells,
        spread=within_spread(cells),
        contrasts=tuple(
            Contrast(a=conditions[a], b=conditions[b], difference=difference, p_holm=p, test=test)
            for (a, b), difference, p, test in zip(pairs, differences, adjusted, tests, strict=True)
        ),
        left_out=tuple(left_out),
    )


def adjust_holm(p: Sequence[float]) -> list[float]:
    """Return p values for all of some tests together (Holm 1979); NaN stays, and counts as no test."""
    known = sorted((each, k) for k, each in enumerate(p) if np.isfinite(each))
    adjusted, most = [float("nan")] * len(p), 0.0
    for rank, (value, k) in enumerate(known):
        most = max(most, min(value * (len(known) - rank), 1.0))
        adjusted[k] = most
    return adjusted
