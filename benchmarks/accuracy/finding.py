"""What the measurements of finding have in common: their options, and the rows of their verdicts."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

Verdict = tuple[str, float]  # right, wrong or undecided; CPU time [s]


def measure(
    name: str,
    data: str,
    verdict: Callable[[int], Verdict],
    *,
    seeds: tuple[int, int],
    n_quick: int,
    floors: tuple[str, str],
    found_is: str = "start found",
    recordings: Sequence[Callable[[], Verdict]] = (),
) -> None:
    """Measure scenes of the seeds (first, last) or of those asked for, after recordings; write the rows of a full run.

    `--quick` takes the first `n_quick` scenes. `floors` are those of what is found, and of what is wrong and decided.
    """
    usual = f"{seeds[0]}-{seeds[1]}"
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--seeds", default=usual)
    options = parser.parse_args()
    first, last = (int(number) for number in options.seeds.split("-"))
    last = min(last, first + n_quick - 1) if options.quick else last
    found = [*(each() for each in recordings), *(verdict(seed) for seed in range(first, last + 1))]
    words, n = [word for word, _ in found], len(found)
    base = {"data": f"{data} {first}-{last}", "method": "find", "n": n}
    rows = [
        {**base, "metric": found_is, "unit": "%", "value": _percent(words, "right"), "floor": floors[0]},
        {
            **base,
            "metric": "wrong and decided",
            "unit": "%",
            "value": 100 * words.count("wrong") / n,
            "floor": floors[1],
        },
        {**base, "metric": "undecided", "unit": "%", "value": _percent(words, "undecided")},
        {**base, "metric": "CPU time, median", "unit": "s", "value": float(np.median([cpu_s for _, cpu_s in found]))},
    ]
    if options.quick or options.seeds != usual:
        for row in rows:
            print(f"{row['metric']}: {row['value']:.3g} {row['unit']}  {row.get('floor', '')}")
    else:
        append(name, rows)


def _percent(words: Sequence[str], word: str) -> float:
    return 100 * words.count(word) / len(words)
