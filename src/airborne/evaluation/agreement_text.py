"""Agreement as text: a short table, and a methods paragraph with its numbers filled in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TypeVar

from airborne.evaluation.agreement import Agreement
from airborne.evaluation.columns import align_columns
from airborne.evaluation.compare import or_dash
from airborne.evaluation.repeatability import Repeatability
from airborne.evaluation.variables import individuals_of
from airborne.motion.jumps.jump import Measurement

_REFERENCES = {  # as the text cites them
    "Bland and Altman 1999": (
        "Bland JM, Altman DG (1999) Measuring agreement in method comparison studies. Stat Methods Med Res 8:135-160."
    ),
    "Bland and Altman 2007": (
        "Bland JM, Altman DG (2007) Agreement between methods of measurement with multiple observations per "
        "individual. J Biopharm Stat 17:571-582."
    ),
    "McGraw and Wong 1996": (
        "McGraw KO, Wong SP (1996) Forming inferences about some intraclass correlation coefficients. "
        "Psychol Methods 1:30-46."
    ),
    "Zou 2013": (
        "Zou GY (2013) Confidence interval estimation for the Bland-Altman limits of agreement with multiple "
        "observations per individual. Stat Methods Med Res 22:630-642."
    ),
}

_FEW = 10  # moments: of fewer, a standard deviation itself is unsure by a quarter, 1 / sqrt(2 (n - 1))
_Row = TypeVar("_Row")
_AGAINST, _BETWEEN = "Against ", "Between "  # how paragraphs of results begin


def agreement_table(rows: Sequence[Agreement]) -> str:
    """Return agreement as a short plain table; lines below it say where there are few moments, or one."""
    table = [("agreement", "n", "bias", "95 % limits", "RMSE", "nRMSE", "ICC(A,1)", "SEM")]
    for row in rows:
        has_limits = math.isfinite(row.lower_limit.value)
        limits = f"{_number(row.lower_limit.value)} to {_number(row.upper_limit.value)}" if has_limits else "-"
        share = or_dash(row.nrmse_percent.value / 100, ".2%")
        icc = or_dash(row.icc.agreement.value, ".4f")
        name, errors = f"  {row.name} [{row.unit}]", (_number(row.bias.value), limits, _number(row.rmse.value))
        table.append((name, str(row.n), *errors, share, icc, _number(row.sem.value)))
    lines = align_columns(table, (16, 6, 9, 19, 9, 8, 10, 9))
    if any(1 < row.n < _FEW for row in rows):
        lines.append("  few frames: these numbers are rough; agreement.csv holds the 95 % interval of each")
    if any(row.n == 1 for row in rows):
        lines.append(
            "  of a single value, as of one jump, there is a difference, and no limits of agreement, ICC or SEM"
        )
    return "\n".join(lines)


def repeatability_table(rows: Sequence[Repeatability]) -> str:
    """Return repeatability as a short plain table."""
    table = [("repeatability", "within sd", "coefficient", "ICC(A,1)", "SEM", "MDC")]
    for row in rows:
        icc = or_dash(row.icc.agreement.value, ".4f")
        name, spread = f"  {row.name} [{row.unit}]", (_number(row.within_sd.value), _number(row.coefficient.value))
        table.append((name, *spread, icc, _number(row.sem.value), _number(row.mdc.value)))
    return "\n".join(align_columns(table, (16, 10, 12, 10, 9, 9)))


def methods_text(
    agreements: Mapping[str, Sequence[Agreement]],
    repeatabilities: Mapping[str, Sequence[Repeatability]],
    versions: Mapping[str, str],
    *,
    questions: Mapping[str, Sequence[str]] = MappingProxyType({}),
    earlier: str = "",
) -> str:
    """Return a paragraph for a methods section, its results, and its references; numbers with 95 % intervals.

    `agreements` and `repeatabilities` hold the headline variables by what they were compared with, `questions` what is
    asked about these. Of an `earlier` text, the results of comparisons with something else stay.
    """
    results = _results_of(earlier)
    results |= _paragraphs(_AGAINST, agreements, _agreement_sentence, questions)
    results |= _paragraphs(_BETWEEN, repeatabilities, _repeat_sentence)
    software = ", ".join(f"{name} {version}" for name, version in versions.items())
    has_angles = any(" deg" in each for each in results.values())
    of_angles = (
        "Angles are in degrees; their differences were taken on the circle, within half a turn either way, and "
        "somersault and twist left out within 5 degrees of 90 degrees of tilt. "
    )
    text = [
        f"Agreement was computed with Airborne ({software}). Coordinates are in a world frame with z up. "
        + of_angles * has_angles
        + "Frames were matched in time to within a tenth of a period; frames without a measurement were left out."
    ]
    if any(head.startswith(_AGAINST) for head in results):
        text.append(
            "Bias is the mean of measured minus reference. The 95 % limits of agreement are bias ± 1.96 standard "
            "deviations of a single difference, the variance being the sum of that between and that within individuals "
            "(players, jumps or joints, as named) for a true value that varies (Bland and Altman 2007), with intervals "
            "by variance estimates recovery (Zou 2013). nRMSE is the root mean square error over the range of the "
            "reference. ICC(A,1) and ICC(C,1) are two-way intraclass correlations of a single measurement for absolute "
            "agreement and for consistency (McGraw and Wong 1996). SEM is the square root of the two-way residual mean "
            "square, and the minimal detectable change 1.96 sqrt(2) SEM."
        )
    if any(head.startswith(_BETWEEN) for head in results):
        text.append(
            "Repeatability is the standard deviation within moments, over all measurements of a moment, and its "
            "coefficient 1.96 sqrt(2) times that (Bland and Altman 1999)."
        )
    text.append(
        "As neighbouring frames err alike, intervals rest on the effective number of frames, n / (1 + 2 sum of the "
        "autocorrelations of the differences)."
    )
    said = " ".join(text)
    references = [reference for cited, reference in _REFERENCES.items() if cited in said]
    return "\n\n".join([said, *results.values(), "\n".join(["References", *references])]) + "\n"


def _paragraphs(
    begin: str,
    results: Mapping[str, Sequence[_Row]],
    say: Callable[[_Row], str],
    questions: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> dict[str, str]:
    paragraphs = {}
    for name, rows in results.items():
        doubts = [f"Doubtful: {question}" for question in questions.get(name, ())]
        paragraphs[head] = "\n".join([head := f"{begin}{name}:", *doubts, *map(say, rows)])
    return paragraphs


def _results_of(text: str) -> dict[str, str]:
    """Return a text's paragraphs of results, by their first lines."""
    heads = {part: part.partition("\n")[0] for part in text.split("\n\n")}
    return {head: part for part, head in heads.items() if head.startswith((_AGAINST, _BETWEEN)) and head.endswith(":")}


def _agreement_sentence(row: Agreement) -> str:
    if row.n < 2:
        count = "one value" if row.n else "no value"
        return f"{row.name}: {count}, measured minus reference {_ci(row.bias)} {row.unit}."
    who = f"{row.n_individuals} {individuals_of(row.name)}, " if row.n_individuals > 1 else ""
    return (
        f"{row.name} ({who}n = {row.n}, effectively {row.n_effective:.0f}): bias {_ci(row.bias)} {row.unit}, limits "
        f"{_ci(row.lower_limit)} to {_ci(row.upper_limit)} {row.unit}, RMSE {_ci(row.rmse)} {row.unit}, nRMSE "
        f"{_ci(row.nrmse_percent)} % of {row.range:.4g} {row.unit}, ICC(A,1) {_ci(row.icc.agreement, 4)}, "
        f"ICC(C,1) {_ci(row.icc.consistency, 4)}, SEM {_ci(row.sem)} {row.unit}, minimal detectable change "
        f"{_ci(row.mdc)} {row.unit}."
    )


def _repeat_sentence(row: Repeatability) -> str:
    return (
        f"{row.name} ({row.n_ways} measurements, n = {row.n}, effectively {row.n_effective:.0f}): standard deviation "
        f"within moments {_ci(row.within_sd)} {row.unit}, coefficient of repeatability {_ci(row.coefficient)} "
        f"{row.unit}, ICC(A,1) {_ci(row.icc.agreement, 4)}, SEM {_ci(row.sem)} {row.unit}, minimal detectable "
        f"change {_ci(row.mdc)} {row.unit}."
    )


def _ci(measured: Measurement, digits: int = 2) -> str:
    """Format a number with its interval in brackets."""
    if math.isnan(measured.value):
        return "unknown"
    if math.isnan(measured.low):
        return f"{measured.value:.{digits}f}"
    return f"{measured.value:.{digits}f} [{measured.low:.{digits}f}, {measured.high:.{digits}f}]"


def _number(value: float) -> str:
    return or_dash(value, ".2f")
