"""The tables of the reproduced block-jump paper, as Markdown and as rows of a CSV file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from airborne.evaluation.jump_errors import EVENTS, HEIGHTS
from airborne.reproduction.block.causes import TORSO_OFF_M
from airborne.reproduction.block.plan import PAPER_PARTS, PAPER_SUCCESS
from airborne.reproduction.block.summary import Summary

CSV_HEADER = ("row", "part", "paper_percent", "success_percent", "sd_over_seeds", "tolerance_m", "touching_percent",
              "mean_mm", "median_mm", "within_100mm_percent", "within_50mm_percent", "within_95_percent")  # fmt: skip
_TOLERANCES = {"success": "tolerance_m", "touching": "touching_tolerance_m"}  # of what is compared with the paper's
_TITLES = ("hips left", "right", "knees left", "right", "feet left", "right")
_HEIGHT_TITLES = ("feet", "hips", "flight time", "take-off speed", "hips from take-off")


def markdown(summary: Summary) -> str:
    """Return all tables."""
    tables = [
        (_first_line(summary), _success(summary, "success")),
        ("The same where the rectangles need only touch:", _success(summary, "touching")),
        ("Only sequences with one blocker:", _success(summary, "success_one_blocker")),
        ("Only sequences with several blockers:", _success(summary, "success_several")),
        (
            "Strict: distance from the true joint [mm], mean / median; the mean's sd over seeds follows ±",
            _strict(summary),
        ),
        ("Share of all joints, percent:", _shares(summary)),
        ("Jumps against the scenes' own facts, mean absolute error (mean):", _jumps(summary)),
        ("Particles of `block-jump`:", _sweep(summary)),
        ("Sequences with a part under 80 %:", _failures(summary)),
    ]
    return "\n\n".join(f"{title}\n\n{table}" for title, table in tables if table) + "\n"


def success_table(summary: Summary) -> str:
    """Return Table I beside the paper's, with its tolerance."""
    return f"{_first_line(summary)}\n\n{_success(summary, 'success')}"


def csv_rows(summary: Summary) -> list[list[str]]:
    """Return a row for each method and part, as CSV_HEADER."""
    rows = []
    for name, row in summary["rows"].items():
        for k, part in enumerate(PAPER_PARTS):
            numbers = [
                PAPER_SUCCESS[name][k] if name in PAPER_SUCCESS else math.nan,
                100 * row["success"]["mean"][k],
                100 * row["success"]["sd"][k],
                summary["tolerance_m"][k],
                100 * row["touching"]["mean"][k],
                row["mean_mm"]["mean"][k],
                row["median_mm"][k],
                *(100 * row[key][k] for key in ("within_100mm", "within_50mm", "within_95")),
            ]
            rows.append([name, part, *(f"{value:.5g}" if math.isfinite(value) else "" for value in numbers)])
    return rows


def _first_line(summary: Summary) -> str:
    several = f", {summary['n_several']} of them with several blockers" if summary["n_several"] else ""
    return (
        f"{len(summary['sequences'])} sequences{several}, {summary['n_frames']} frames, "
        f"{summary['n_player_frames']} of players; {summary['n_particles']} particles; percent of frames, "
        f"mean ± sd over {summary['n_seeds']} seeds"
    )


def _success(summary: Summary, key: str) -> str:
    lines = []
    for name, row in summary["rows"].items():
        if row[key] is None:
            continue
        if name in PAPER_SUCCESS and key in _TOLERANCES:
            lines.append([f"paper's `{name}`", *(f"{value:.1f}" for value in PAPER_SUCCESS[name])])
        cells = [_with_sd(100 * m, 100 * s) for m, s in zip(row[key]["mean"], row[key]["sd"], strict=True)]
        lines.append([_code(name), *cells])
    if not lines:
        return ""
    if key in _TOLERANCES:
        lines.append(["may be off by [m]", *(f"{value:.3f}" for value in summary[_TOLERANCES[key]])])
    return _table(("success", *_TITLES), lines)


def _strict(summary: Summary) -> str:
    lines = []
    for name, row in summary["rows"].items():
        of_parts = zip(row["mean_mm"]["mean"], row["mean_mm"]["sd"], row["median_mm"], strict=True)
        lines.append(
            [_code(name), *(f"{_with_sd(mean, sd, 0)} / {_number(median, 0)}" for mean, sd, median in of_parts)]
        )
    return _table(("error", *_TITLES), lines)


def _shares(summary: Summary) -> str:
    titles = ("", "<= 0.10 m", "<= 0.05 m", "in the stated 95 %", "knees swapped", "feet swapped",
              "limbs correct (PCP 0.5)", "frames lost", "uncertain", "CPU ms per frame and player")  # fmt: skip
    lines = []
    for name, row in summary["rows"].items():
        means = [sum(row[key]) / len(PAPER_PARTS) for key in ("within_100mm", "within_50mm", "within_95")]
        shares = [*means, *(row[key] for key in ("swaps_knees", "swaps_feet", "limbs_correct", "lost", "uncertain"))]
        ms = row["ms_per_frame"] + (summary["torso"]["ms_per_frame"] if _tracks_torsos(name) else 0.0)
        lines.append([_code(name), *(_number(100 * share, 1) for share in shares), _number(ms, 1)])
    torso = summary["torso"]
    note = (
        f"The tracked torsos are off by {torso['mean_mm']:.0f} mm on the mean ({torso['median_mm']:.0f} median; over "
        f"{TORSO_OFF_M:.2f} m in {100 * torso['off']:.1f} % of the frames). Following them is "
        f"{torso['ms_per_frame']:.1f} ms of the three filters' time."
    )
    return f"{_table(titles, lines)}\n\n{note}"


def _tracks_torsos(row: str) -> bool:
    return row != "blocker" and not row.endswith("torsos given")


def _jumps(summary: Summary) -> str:
    titles = ("", "found", *(f"{title} [mm]" for title in _HEIGHT_TITLES), "take-off [frames]", "landing [frames]",
              "heights in their 95 %")  # fmt: skip
    lines = []
    for name, row in summary["jumps"].items():
        heights = [_error(row[key], 1e3, 0) for key in HEIGHTS]
        events = [_error(row[key], 1.0, 2) for key in EVENTS]
        coverage = [row[key]["within_95"] for key in HEIGHTS if math.isfinite(row[key]["within_95"])]
        in_95 = f"{100 * sum(coverage) / len(coverage):.0f} %" if coverage else "-"
        lines.append([_code(name), f"{row['n_found']} of {row['n']}", *heights, *events, in_95])
    return _table(titles, lines)


def _sweep(summary: Summary) -> str:
    lines = []
    for row in summary["sweep"]:
        if row["success"] is None:
            continue
        cells = [_with_sd(100 * m, 100 * s) for m, s in zip(*(row["success"][k] for k in ("mean", "sd")), strict=True)]
        lines.append([str(row["n_particles"]), *cells, f"{row['ms_per_frame']:.1f}"])
    return _table(("particles", *_TITLES, "ms"), lines) if lines else ""


def _failures(summary: Summary) -> str:
    lines = []
    for name, failures in summary["failed"].items():
        for failure in failures:
            causes = ", ".join(f"{cause} {100 * share:.0f} %" for cause, share in failure["causes"].items())
            first = "-" if failure["first_frame_off"] is None else str(failure["first_frame_off"])
            worst = f"{failure['worst_part'].replace('_', ' ')} {100 * failure['worst_success']:.0f} %"
            lines.append(
                [_code(name), str(failure["sequence"]), str(failure["n_blockers"]), worst, first, causes or "-"]
            )
    titles = ("", "sequence", "blockers", "worst part", "off from frame", "parts off by over 0.10 m, by cause")
    return _table(titles, lines) if lines else "None."


def _table(titles: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = [titles, ["---"] * len(titles), *lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _code(name: str) -> str:
    method, comma, rest = name.partition(",")
    return f"`{method}`{comma}{rest}"


def _with_sd(mean: float, sd: float, digits: int = 1) -> str:
    return _number(mean, digits) + (f" ± {sd:.{digits}f}" if math.isfinite(sd) else "")


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def _error(error: Mapping[str, float], scale: float, digits: int) -> str:
    if not error["n"]:
        return "-"
    return f"{scale * error['mean_absolute']:.{digits}f} ({scale * error['mean']:+.{digits}f})"
