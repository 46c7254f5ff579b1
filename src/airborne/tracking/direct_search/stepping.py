"""Paper B's downhill stepping: one variable at a time, in loops of shrinking steps, ended by the V rule.

A coordinate descent on any score (n, d) -> (n,); knows no body and no image.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from airborne.types import Array

Objective = Callable[[Array], Array]  # (n, d) -> (n,)
VRule = Literal["v_literal", "v_sym"]

_MOST_STEPS = 40  # in one direction; a score that never rises has lost the body


def minimise_by_stepping(
    score: Objective, start: Array, loops: Sequence[Array], *, v_rule: VRule, order: Sequence[int] | None = None
) -> tuple[Array, int]:
    """Minimise from start (d,), one loop over the variables for each row of steps (d,); return (best, evaluations).

    Paper B, "Method": a variable is stepped downhill until the score has risen twice in a row, then set by the V rule.
    Downhill is toward the lower neighbour. `order` is that of the variables in a loop, which the paper does not print;
    by default they come in their own order.
    """
    x, evaluations = np.array(start, float), 0
    for steps in loops:
        for variable in range(len(x)) if order is None else order:
            step = steps[variable]
            if step == 0:
                continue
            line = _Line(score, x, variable, step)
            x[variable] += step * _minimum_on_line(line, v_rule)
            evaluations += len(line.values)
    return x, evaluations


def v_literal(before: float, lowest: float, after: float, last: float) -> float:
    """Cross the lines (-1, before)-(0, lowest) and (1, after)-(2, last); steps from the lowest point, in [-1, 1].

    As the paper has it. Where the true minimum lies before the lowest point the answer is 0, and also where a
    neighbour is infinite.
    """
    down, up = before - lowest, last - after
    if not 0 < down + up < np.inf:
        return 0.0
    return min(max((up - (after - lowest)) / (down + up), -1.0), 1.0)


class _Line:
    """The score along one variable, at whole numbers of steps; nothing is evaluated twice."""

    def __init__(self, score: Objective, x: Array, variable: int, step: float) -> None:
        self._score, self._x, self._variable, self._step = score, x, variable, step
        self.values: dict[int, float] = {}

    def __call__(self, k: int) -> float:
        if k not in self.values:
            self.evaluate(k)
        return self.values[k]

    def evaluate(self, *ks: int) -> None:
        """Evaluate the score at several numbers of steps at once."""
        x = np.repeat(self._x[None], len(ks), axis=0)
        x[:, self._variable] += np.array(ks) * self._step
        self.values.update(zip(ks, self._score(x).tolist(), strict=True))


def _minimum_on_line(line: _Line, v_rule: VRule) -> float:
    """Return where the score is lowest, in steps from 0."""
    line.evaluate(-1, 0, 1)
    way = 1 if line(1) < line(-1) else -1
    k = 0
    while k < _MOST_STEPS and (line(way * (k + 1)) < line(way * k) or line(way * (k + 2)) < line(way * (k + 1))):
        k += 1
    lowest = min(range(k + 1), key=lambda i: line(way * i))
    before, middle, after = (line(way * (lowest + i)) for i in (-1, 0, 1))
    if v_rule == "v_sym" and before < after:
        return way * (lowest - v_literal(after, middle, before, line(way * (lowest - 2))))
    return way * (lowest + v_literal(before, middle, after, line(way * (lowest + 2))))
