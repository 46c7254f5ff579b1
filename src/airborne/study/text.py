"""The methods paragraph of a comparison, and its results as sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne import __version__
from airborne.errors import count, format_digits
from airborne.study.comparison import ALPHA, Contrast, VariableComparison
from airborne.study.spm import NOT_TESTED, format_p

_REFERENCES = {
    "random effects": (
        "Hartung J, Knapp G (2001). A refined method for the meta-analysis of controlled clinical trials with binary "
        "outcome. Statistics in Medicine 20, 3875-3889.",
        "Paule RC, Mandel J (1982). Consensus values and weighting factors. Journal of Research of the National Bureau "
        "of Standards 87, 377-385.",
    ),
    "numbers": (
        "Holm S (1979). A simple sequentially rejective multiple test procedure. Scand. J. Statistics 6, 65-70.",
    ),
    "curves": (
        "Pataky TC (2012). One-dimensional statistical parametric mapping in Python. Computer Methods in Biomechanics "
        "and Biomedical Engineering 15, 295-301.",
    ),
}
_LEVELS = {
    "within athletes": "within {} with trials in both conditions",
    "between athletes": "between athletes ({}), as too few have trials in both conditions",
    "between trials": "between the trials of one athlete, and so of that athlete only",
}

_NOT_REPEATED = (
    "how much trials differ, and the minimal detectable change, need two trials of an athlete in a condition, and none "
    "has two"
)


def describe_study(
    comparisons: Sequence[VariableComparison],
    events: Sequence[str],
    *,
    real_time: bool,
    left_out: Sequence[str] = (),
) -> str:
    """Return a methods paragraph, one of results, what was left out, and the references.

    `left_out` says which trials no comparison has; each comparison names its own.
    """
    curves = [each for each in comparisons if each.axis is not None]
    numbers = [each for each in comparisons if each.axis is None]
    levels = dict.fromkeys(contrast.difference.level for each in comparisons for contrast in each.contrasts)
    text = [f"Trials were measured with Airborne {__version__}."]
    if curves and real_time:
        text.append(f"Curves were compared in real time since {events[0]}, as far as the shortest trial reaches.")
    elif curves:
        text.append(
            f"Curves were normalised in time, piecewise linearly between {', '.join(events)}, to 101 nodes a stretch."
        )
    are_repeated = [bool(np.isfinite(each.spread.mdc).any()) for each in comparisons]
    if any(are_repeated):
        text.append(
            "Each athlete's mean in each condition has the variance of a mean of their trials, pooled within athletes "
            "and conditions, which holds the error of the measurement."
        )
    if not all(are_repeated):
        text.append(
            "Where no athlete has two trials in a condition, each mean has the variance of the measurement alone."
        )
    text.append(
        "Differences of conditions were pooled over athletes with random effects: the variance between athletes by "
        "Paule and Mandel (1982), 95 % intervals by Hartung and Knapp (2001) with Student's t, no narrower than trials "
        "and measurement alone make them."
    )
    if "between trials" in levels:
        text.append("With a single athlete, the interval is Welch's, of trials, and holds for that athlete only.")
    if numbers:
        text.append("P values of all pairs of conditions were adjusted after Holm (1979).")
    if curves:
        text.append(
            "Curves of the athletes' means were compared by two-sided t-tests with one-dimensional statistical "
            f"parametric mapping (Pataky 2012, spm1d), alpha = {ALPHA:g} for all pairs of conditions together."
        )
    if any(are_repeated):
        text.append(
            "The minimal (smallest) detectable change of a single trial is 1.96 sqrt(2) times the standard deviation "
            "within athletes and conditions."
        )
    lines = ["Methods", " ".join(text), "", "Results"]
    lines += [f"{each.title}: {sentence}" for each in comparisons for sentence in _results(each)]
    left_out = list(dict.fromkeys([*(line for each in comparisons for line in each.left_out), *left_out]))
    lines += [
        "",
        "Left out",
        *(left_out or ["nothing"]),
        "",
        "References",
        *_references(numbers=numbers, curves=curves),
    ]
    return "\n".join(lines) + "\n"


def _references(**used: Sequence[VariableComparison]) -> list[str]:
    names = ["random effects", *(name for name, comparisons in used.items() if comparisons)]
    return sorted(reference for name in names for reference in _REFERENCES[name])


def _results(comparison: VariableComparison) -> list[str]:
    spread = comparison.spread
    sentences = [
        _number(each, comparison) if comparison.axis is None else _curve(each, comparison)
        for each in comparison.contrasts
    ]
    sds = [float(np.median(each)) for each in (spread.sd_within, spread.sd_measurement, spread.mdc)]
    is_repeated, is_stated = not np.isnan(sds[0]), bool(sds[1])
    within, measured, mdc = (format_digits(each, 3) for each in sds)
    over = "" if comparison.axis is None else ", median over the curve,"
    stated = "the runs state none for the measurement"
    if is_stated:
        stated = f"the runs state {measured} for the measurement, errors included that trials share"
    if not is_repeated:
        return [*sentences, f"{_NOT_REPEATED} ({stated}{over.removesuffix(',') if is_stated else ''})."]
    sentences.append(
        f"standard deviation between trials of one athlete and condition{over} {within} ({stated}); "
        f"minimal detectable change of a trial {mdc}."
    )
    return sentences


def _number(contrast: Contrast, comparison: VariableComparison) -> str:
    difference, level, p = contrast.difference, _describe_level(contrast, comparison), contrast.p_holm
    assert p is not None, "a number has one"
    value, low, high = (format_digits(each[0], 4) for each in (difference.value, difference.low, difference.high))
    if not np.isfinite(p):
        return f"{contrast.b} minus {contrast.a} is {value} and {NOT_TESTED}; {level}."
    return f"{contrast.b} minus {contrast.a} {value}, 95 % interval {low} to {high}, {format_p(p)}; {level}."


def _curve(contrast: Contrast, comparison: VariableComparison) -> str:
    test, axis = contrast.test, comparison.axis
    assert test is not None and axis is not None, "a curve has a test"
    level = _describe_level(contrast, comparison)
    if not np.isfinite(test.threshold):
        return f"{contrast.b} minus {contrast.a} {NOT_TESTED}; {level}."
    threshold = format_digits(test.threshold, 3)
    if not test.clusters:
        return f"{contrast.b} and {contrast.a} do not differ anywhere, |t| below {threshold}; {level}."

    def at(node: float) -> str:
        return format_digits(float(np.interp(node, np.arange(len(axis)), axis)), 3)

    spans = [f"from {at(low)} to {at(high)} ({format_p(p)})" for low, high, p in test.clusters]
    return (
        f"{contrast.b} and {contrast.a} differ, |t| above {threshold}, {', '.join(spans)} of "
        f"{comparison.axis_label}; {level}."
    )


def _describe_level(contrast: Contrast, comparison: VariableComparison) -> str:
    a, b = contrast.difference.samples
    level = contrast.difference.level
    n = count(len(a), "athlete") if level == "within athletes" else f"{len(a)} and {len(b)}"
    if level == "between athletes":
        in_a, in_b = (comparison.cells.athletes_in(comparison.conditions.index(k)) for k in (contrast.a, contrast.b))
        for athlete in np.intersect1d(in_a, in_b).tolist():
            n += f", of whom {comparison.athletes[athlete]} is in both and counts in each"
    return _LEVELS[level].format(n)
