"""A finished run against references: the truth, paths of joints, points clicked by hand; other runs, other people.

`assess` gives errors; `evaluate_agreement` says how well they agree: bias, limits of agreement, ICC, repeatability.
"""

from __future__ import annotations

import mimetypes
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airborne.body.symmetry import symmetries
from airborne.cameras import read_rig
from airborne.errors import ResultError
from airborne.evaluation import (
    Agreement,
    DigitisedComparison,
    FlightComparison,
    JointComparison,
    MotionComparison,
    PlayersComparison,
    Repeatability,
    analyse_agreement,
    analyse_repeatability,
    assess_players,
    compare_digitised,
    compare_flight,
    compare_joints,
    compare_motion,
    describe_left_out,
    fit_digitised_poses,
    read_digitised,
    read_flight_paths,
    read_joint_paths,
    read_truth,
)
from airborne.evaluation.agreement_tables import write_agreements, write_repeatability
from airborne.evaluation.agreement_text import agreement_table, methods_text, repeatability_table
from airborne.evaluation.variables import headline_series
from airborne.export import write_json
from airborne.export.report import write_report
from airborne.export.viewer import body_viewer
from airborne.io.text import read_text
from airborne.io.writing import write_text
from airborne.motion import run_folder
from airborne.motion.run_folder import check_record, holds_players, read_body_run, read_record
from airborne.run.doubtful_runs import doubt_runs
from airborne.run.folder import open_results
from airborne.run.provenance import versions
from airborne.run.reference_series import body_series, players_series

Comparison = MotionComparison | DigitisedComparison | JointComparison | FlightComparison | PlayersComparison
Comparisons = Mapping[str, Comparison]

_SERIES_OF = {"truth": "the truth", "joints": "the joints", "digitised": "points digitised"}  # by comparison
_LARGEST_METHODS_BYTES = 1_000_000  # a hundred comparisons; anything larger was not written here


def assess(
    folder: Path,
    truth: Path | None,
    digitised: Path | None,
    joints: Path | None = None,
    *,
    flight: Path | None = None,
    keep: bool = True,
) -> Comparisons:
    """Compare the run in a folder; `keep` puts it into the run's summary, of one body into figures and report too.

    `joints` are paths of joints as `read_joint_paths` reads them, with which smoothed joints in the folder are compared
    too, `flight` what `read_flight_paths` reads. Raises ResultError where the folder holds no finished run or a file
    cannot be read.
    """
    if holds_players(folder):
        return _assess_players(folder, truth, is_alone=digitised is joints is flight is None, keep=keep)
    motion, model = read_body_run(folder)
    if truth is digitised is joints is flight is None:
        raise ResultError(
            "nothing to compare with; give a truth.csv, --digitised, --joints, --flight, --joint-angles, or --repeat "
            "with a run"
        )
    if not motion.has_pose.any():
        raise ResultError(f"{folder}: the body was found in no frame, so there is nothing to compare; track again")
    symmetry = symmetries(model)
    comparisons: dict[str, MotionComparison | DigitisedComparison | JointComparison | FlightComparison] = {}
    true_poses = clicked = None
    if truth is not None:
        true_poses = read_truth(truth)
        comparisons["truth"] = compare_motion(motion, true_poses, symmetry)
    if digitised is not None:
        rig = read_rig(folder / run_folder.CALIBRATION)
        clicked = fit_digitised_poses(read_digitised(digitised, rig), rig, model)
        comparisons["digitised"] = compare_digitised(motion, clicked, symmetry)
    if joints is not None:
        paths, smooth = read_joint_paths(joints), folder / run_folder.SMOOTH_JOINTS
        comparisons["joints"] = compare_joints(motion, model, paths)
        if smooth.is_file():
            comparisons["smooth_joints"] = compare_joints(motion, model, paths, read_joint_paths(smooth))
    if flight is not None:
        comparisons["reference_flight"] = compare_flight(motion, model, read_flight_paths(flight))
    if not keep:
        return comparisons
    with open_results(folder):
        summary = _add_to_summary(folder, comparisons)
        if summary and (folder / run_folder.REPORT).is_file():
            from airborne.export.error_figures import write_digitised, write_errors

            figures = run_folder.figures_of(folder)
            if true_poses is not None:
                write_errors(figures / "errors.png", motion, true_poses, symmetry)
            if clicked is not None:
                write_digitised(figures / "digitised.png", motion, clicked, symmetry)
            write_report(folder, summary, body_viewer(folder, motion, model))
    return comparisons


def _assess_players(folder: Path, truth: Path | None, *, is_alone: bool, keep: bool) -> Comparisons:
    if truth is None or not is_alone:
        leave_out = "" if is_alone else "leave clicked points, joints and flights out and "
        raise ResultError(
            f"{folder} holds a run of players, which is compared with a truth of players only; {leave_out}give a "
            "truth.csv"
        )
    check_record(folder)
    comparisons = {"truth": assess_players(folder, truth)}
    if keep:
        with open_results(folder):
            _add_to_summary(folder, comparisons)
    return comparisons


def _add_to_summary(folder: Path, comparisons: Comparisons) -> dict:
    """Put comparisons into the run's summary and return it; {} where the run has none, or is not ours to write."""
    path = folder / run_folder.SUMMARY
    if not path.is_file() or not os.access(folder, os.W_OK):
        return {}
    summary = run_folder.read_summary(folder) | {name: each.to_dict() for name, each in comparisons.items()}
    write_json(path, summary)
    return summary


@dataclass(frozen=True, slots=True, eq=False)
class AgreementReport:
    """Agreement by reference that the run was compared with; repeatability by what was repeated."""

    agreements: dict[str, list[Agreement]]
    repeats: dict[str, list[Repeatability]]
    headlines: frozenset[str]  # names of the headline variables
    left_out: tuple[str, ...]  # points of the references that the body does not have
    folder: Path
    files: tuple[str, ...]  # in it
    doubts: tuple[str, ...] = ()  # on the runs themselves, one line each

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers for a JSON file."""
        return {
            "agreement": {name: [row.to_dict() for row in rows] for name, rows in self.agreements.items()},
            "repeatability": {name: [row.to_dict() for row in rows] for name, rows in self.repeats.items()},
        }

    def describe(self) -> str:
        """Return the headline variables as short plain tables."""
        lines = describe_left_out(self.left_out)
        for name, rows in self.agreements.items():
            lines += [f"agreement with {name}", agreement_table([row for row in rows if row.name in self.headlines])]
        for name, rows in self.repeats.items():
            lines += [f"between {name}", repeatability_table([row for row in rows if row.name in self.headlines])]
        return "\n".join([*lines, *self.doubts, f"wrote into {self.folder}: {', '.join(self.files)}"])


def evaluate_agreement(
    folder: Path,
    truth: Path | None = None,
    digitised: Path | None = None,
    joints: Path | None = None,
    *,
    joint_angles: Path | None = None,
    repeats: Sequence[Path] = (),
    operators: Sequence[Path] = (),
    out: Path | None = None,
    comparisons: Comparisons | None = None,
) -> AgreementReport:
    """Say how well the run in a folder agrees with references, and how well repetitions agree with one another.

    `repeats` are folders of other runs of the same trial; `operators` files of points that other people clicked in the
    pictures of `digitised`. Writes agreement.csv, repeatability.csv, figures and a methods paragraph into the run's
    folder, or into `out`, where results of earlier comparisons with something else stay. What `comparisons`, of
    `assess`, ask about the references stands in the paragraph. Raises ResultError where something is no run, cannot be
    read, or is a run of other videos.
    """
    if operators and digitised is None:
        raise ResultError("clicks of other people are compared with the first person's; give those as --digitised")
    _check_different("--repeat", (folder, *repeats), "another run")
    _check_different("--operator", (digitised or Path(), *operators), "another person's clicks")
    _check_same_videos(folder, repeats)
    if out is not None and run_folder.holds_run(out) and not out.samefile(folder):
        raise ResultError(f"{out} holds another run, whose own comparisons lie there; give a folder without one")
    if holds_players(folder):
        if digitised or joints or joint_angles:
            raise ResultError(f"{folder} holds a run of players; give a truth.csv of players, or other runs of it")
        references, repeated = players_series(folder, truth, repeats)
        left_out: list[str] = []
    else:
        references, repeated, left_out = body_series(
            folder,
            truth,
            digitised=digitised,
            joints=joints,
            joint_angles=joint_angles,
            repeats=repeats,
            operators=operators,
        )
    agreements = {name: [analyse_agreement(one) for one in series] for name, series in references.items()}
    repeatable = {name: [analyse_repeatability(one) for one in series] for name, series in repeated.items()}
    first = frozenset(
        one.name for series in (*references.values(), *repeated.values()) for one in headline_series(series)
    )
    with open_results(out := out or folder):
        files = []
        if agreements:
            write_agreements(run_folder.tables_of(out).parent / run_folder.AGREEMENT, agreements)
            files.append(run_folder.AGREEMENT)
        if repeatable:
            write_repeatability(run_folder.tables_of(out).parent / run_folder.REPEATABILITY, repeatable)
            files.append(run_folder.REPEATABILITY)
        for name, series in references.items():
            word = name.split()[-1]
            pairs = zip(series, agreements[name], strict=True)
            plotted = [(one, row) for one, row in pairs if one.name in first and row.n > 1]
            if plotted:
                from airborne.export.analysis_figures import write_bland_altman, write_identity

                write_bland_altman(run_folder.figures_of(out) / f"agreement_{word}.png", plotted)
                write_identity(run_folder.figures_of(out) / f"identity_{word}.png", plotted)
                files += [f"figures/agreement_{word}.png", f"figures/identity_{word}.png"]
        text = methods_text(
            {name: [row for row in rows if row.name in first] for name, rows in agreements.items()},
            {name: [row for row in rows if row.name in first] for name, rows in repeatable.items()},
            versions(),
            questions={
                _SERIES_OF[name]: each.questions for name, each in (comparisons or {}).items() if name in _SERIES_OF
            },
            earlier=_read_earlier(out / run_folder.AGREEMENT_METHODS),
        )
        write_text(out / run_folder.AGREEMENT_METHODS, text)
    wrote = (*files, run_folder.AGREEMENT_METHODS)
    return AgreementReport(agreements, repeatable, first, tuple(left_out), out, wrote, doubt_runs(folder, repeats))


def _read_earlier(path: Path) -> str:
    try:
        return read_text(path, _LARGEST_METHODS_BYTES)
    except (OSError, ValueError):
        return ""


def _check_different(option: str, paths: Sequence[Path], wanted: str) -> None:
    """Raise ResultError where one file or folder is given twice."""
    resolved = [path.resolve() for path in paths]
    for i, path in enumerate(paths):
        if resolved[i] in resolved[:i]:
            raise ResultError(f"{option} {path} would be compared with itself and agree perfectly; give {wanted}")


def _check_same_videos(folder: Path, repeats: Sequence[Path]) -> None:
    """Raise ResultError where a run has no video in common with the run in a folder, as far as both name theirs."""
    videos = _read_videos_of(folder)
    for other in repeats:
        others = _read_videos_of(other)
        if videos and others and not set(videos) & set(others):
            names = ", ".join([*others.values()][:3])
            raise ResultError(
                f"{other} is a run of other videos ({names}) than {folder}; give a run of the same trial; a run of "
                "other cameras is compared by its joints.csv, as paths of joints"
            )


def _read_videos_of(folder: Path) -> dict[str, str]:
    """Return the names of the videos of the run in a folder by their digests; {} where it names none."""
    record = folder / run_folder.RUN_RECORD
    inputs = read_record(record).get("inputs") if record.is_file() else None
    named = inputs.items() if isinstance(inputs, dict) else ()
    return {
        digest: name
        for name, digest in named
        if isinstance(digest, str) and (mimetypes.guess_type(name)[0] or "").startswith("video/")
    }
