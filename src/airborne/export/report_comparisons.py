"""The comparisons of a run in its report: a table and sentences for each reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from airborne.errors import count
from airborne.export.page import HtmlTable


class ReportComparison(NamedTuple):
    """A table of errors with notes below it."""

    title: str
    table: HtmlTable
    notes: list[str]


def list_comparisons(summary: Mapping[str, Any]) -> Iterator[ReportComparison]:
    """Yield the comparisons that a summary holds, as `write_report` takes it."""
    for key, title in (("truth", "Compared with the truth"), ("digitised", "Compared with points digitised by hand")):
        if summary.get(key):
            yield _pose_comparison(title, summary[key])
    for key, title in (("joints", "Compared with the paths of the joints"), ("smooth_joints", "The same, smoothed")):
        if summary.get(key):
            yield _joint_comparison(title, summary[key])
    if summary.get("reference_flight"):
        yield _flight_comparison(summary["reference_flight"])


def _pose_comparison(title: str, comparison: Mapping[str, Any]) -> ReportComparison:
    errors = comparison.get("tracked_minus_digitised", comparison)
    position, orientation = errors["position"], errors["modulo_run"]
    rows = [(f"{axis} [mm]", position["rms_mm"][k], position["largest_mm"][k]) for k, axis in enumerate("xyz")]
    rows.append(("distance [mm]", position["rms_3d_mm"], position["largest_3d_mm"]))
    for k, angle in enumerate(("somersault", "tilt", "twist")):
        rows.append((f"{angle} [°]", orientation["rms_deg"][k], orientation["largest_deg"][k]))
    rows.append(("whole orientation [°]", orientation["geodesic_rms_deg"], orientation["geodesic_largest_deg"]))
    lines = [f"{errors['n_matched']} of {errors['n_truth']} reference times matched."]
    if errors["n_symmetries"] > 1:
        lines.append("Orientation up to the one symmetry of the body that suits the whole run best.")
    if errors["n_flips"]:
        lines.append(f"{count(errors['n_flips'], 'jump')} between orientations that look the same.")
    if "rigid_fit_residual_rms_mm" in comparison:
        lines.append(f"The clicked points fit a rigid body to {comparison['rigid_fit_residual_rms_mm']:.1f} mm RMS.")
    for what in ("position", "rotation"):
        share = errors[f"{what}_calibration"]
        if share["n"]:
            lines.append(
                f"Of the {what} errors, {share['within_1sd']:.0%} lie within one standard deviation (normal: 68%) "
                f"and {share['within_2sd']:.0%} within two (95%)."
            )
    lines += _doubts(errors)
    table = HtmlTable([(name, f"{rms:.2f}", f"{most:.2f}") for name, rms, most in rows], ("", "RMS", "largest"))
    return ReportComparison(title, table, lines)


def _doubts(comparison: Mapping[str, Any]) -> list[str]:
    """Return what is asked about a reference, which makes its errors doubtful."""
    return [f"Doubtful: {question}" for question in comparison.get("questions", ())]


def _joint_comparison(title: str, comparison: Mapping[str, Any]) -> ReportComparison:
    rows = {**comparison["joints"], "all": comparison["whole"]}
    if comparison["tracked"]:
        rows["all, tracked"] = comparison["tracked"]
    keys = ("mean_mm", "rms_mm", "largest_mm", "mean_without_offset_mm")
    table = HtmlTable(
        [(name, *(each[key] for key in keys)) for name, each in rows.items()],
        ("", "mean [mm]", "RMS [mm]", "largest [mm]", "mean without offset [mm]"),
    )
    lines = [
        f"{comparison['n_matched']} of {comparison['n_reference']} reference times matched.",
        "Without offset: less a constant offset in the segment, as two definitions of a joint have.",
        f"Joints tracked: {comparison['share_tracked']:.0%}; of these more than 100 mm off: {comparison['n_far']}.",
        *_doubts(comparison),
    ]
    return ReportComparison(title, table, lines)


def _flight_comparison(comparison: Mapping[str, Any]) -> ReportComparison:
    keys, found = ("rms", "largest", "bias", "rms_without_bias"), comparison["quantities"]
    rows = [(f"{name} [{each['unit']}]", *(each[key] for key in keys)) for name, each in found.items()]
    table = HtmlTable(rows, ("", "RMS", "largest", "mean", "RMS without the mean"))
    turns = [
        f"{name}: {each['measured_rev']:.3f} turns, {each['reference_rev']:.3f} in the reference."
        for name, each in comparison["turns"].items()
        if None not in each.values()
    ]
    matched = f"{comparison['n_matched']} of {comparison['n_reference']} reference times matched."
    return ReportComparison("Compared with a flight", table, [matched, *turns, *_doubts(comparison)])
