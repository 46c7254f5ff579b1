"""What a reference seems to be mixed up in: its unit, its axes, left and right, its rate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from airborne.evaluation.times import NEAR_MM, nearest_times
from airborne.types import Array

_NEARER = 4.0  # chosen: times nearer at least without the mix-up; another recording's points are not
_FEWEST = 3  # chosen: times at least; one position lies near many others
_ANOTHER_PERIOD = 0.01  # chosen: share by which two periods differ at least; written times are rounded to less
_FAR_MM = 20_000.0  # beyond any error of a body in a hall
_UNITS = {
    "divided by 1000": (1e-3, "millimetres that are read as metres"),
    "times 1000": (1e3, "metres that are read as millimetres"),
    "divided by 100": (1e-2, "centimetres that are read as metres"),
    "times 100": (1e2, "metres that are read as centimetres"),
    "divided by 10": (1e-1, "millimetres that are read as centimetres"),
    "times 10": (1e1, "centimetres that are read as millimetres"),
}
_SIDES = (("_left", "_right"), ("_right", "_left"))


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """Points over time, of a run or a reference: (n,) [s], (n, points, 3) world [m], NaN where not known."""

    time_s: Array
    points: Array


class _Way(NamedTuple):
    """A reference without one mix-up; what was done, and the question that follows."""

    paths: Paths
    done: str
    question: str


def question_mix_up(run: Paths, reference: Paths, names: Sequence[str] = ()) -> str:
    """Ask in one line about the mix-up without which a reference lies near the run, or about its times; else "".

    `names` are the points', of which `_left` and `_right` are tried the other way round.
    """
    far_mm, n = _distance(run, reference)
    ways = [(*_distance(run, way.paths), way) for way in _other_ways(run, reference, names)]
    enough = [each for each in ways if each[1] >= max(n, _FEWEST)]
    if enough:
        near_mm, _, way = min(enough, key=lambda each: each[0])
        if near_mm < min(NEAR_MM, far_mm / _NEARER):
            distances = f"{near_mm:.0f} mm from the run, not {far_mm:.0f} mm"
            return f"with {way.done} the reference would lie {distances}: {way.question}?"
    if question := _question_times(run.time_s, reference.time_s):
        return question
    far = f"the reference lies {far_mm / 1e3:.0f} m from the run; is it in millimetres? Tables hold metres"
    return far if far_mm > _FAR_MM else ""


def _other_ways(run: Paths, reference: Paths, names: Sequence[str]) -> Iterator[_Way]:
    """Yield the reference without each mix-up, the commonest first."""
    time_s, points = reference.time_s, reference.points
    for done, (factor, question) in _UNITS.items():
        yield _Way(Paths(time_s, factor * points), f"its positions {done}", f"are its numbers {question}")
    if (columns := _other_side(names)) != list(range(len(names))):
        question = "are they exchanged, in it or in the run"
        yield _Way(Paths(time_s, points[:, columns]), "its left and right exchanged", question)
    question = f"do its axes point as those of the run's world{' (in a TRC file y points up)' if names else ''}"
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        if order != (0, 1, 2) or min(signs) < 0:
            axes = ", ".join(f"{'-' if sign < 0 else ''}{'xyz'[axis]}" for axis, sign in zip(order, signs, strict=True))
            yield _Way(Paths(time_s, points[..., order] * signs), f"its {axes} taken as x, y, z", question)
    if len(time_s) > 1 and len(run.time_s) > 1:
        period_s, its_period_s = _period(run.time_s), _period(time_s)
        longer = period_s / its_period_s
        if abs(longer - 1) > _ANOTHER_PERIOD:
            question = f"is its rate {1 / period_s:.4g} times a second, not {1 / its_period_s:.4g}"
            for first_s in (0.0, time_s[0]):
                slower = Paths(first_s + longer * (time_s - first_s), points)
                yield _Way(slower, f"its times multiplied by {longer:.3g}", question)


def _other_side(names: Sequence[str]) -> list[int]:
    """Return the columns of the points with left and right exchanged, where both are there."""
    columns = list(range(len(names)))
    for column, name in enumerate(names):
        for side, other in _SIDES:
            if name.endswith(side) and (partner := name.removesuffix(side) + other) in names:
                columns[column] = names.index(partner)
    return columns


def _distance(run: Paths, reference: Paths) -> tuple[float, int]:
    """Return the root mean square distance [mm] where times match, and at how many times; infinite at none."""
    frames, rows, _ = nearest_times(run.time_s, reference.time_s)
    distance = np.linalg.norm(run.points[frames] - reference.points[rows], axis=-1)
    is_known = np.isfinite(distance)
    if not is_known.any():
        return np.inf, 0
    return float(1e3 * np.sqrt(np.mean(distance[is_known] ** 2))), int(is_known.any(axis=1).sum())


def _question_times(time_s: Array, reference_time_s: Array) -> str:
    """Ask about the rate where fewer than half the times match that could, those within the span of both."""
    n = len(nearest_times(time_s, reference_time_s)[0])
    first, last = max(time_s[0], reference_time_s[0]), min(time_s[-1], reference_time_s[-1])
    within = [int(np.sum((each >= first) & (each <= last))) for each in (time_s, reference_time_s)]
    if 2 * n >= min(within) or min(within) < _FEWEST:
        return ""
    return (
        f"only {n} of {min(within)} times match that could: its times are {1e3 * _period(reference_time_s):.4g} ms "
        f"apart, the run's {1e3 * _period(time_s):.4g} ms; are they right, and do both clocks start together?"
    )


def _period(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
