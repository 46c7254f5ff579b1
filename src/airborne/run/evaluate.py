"""A finished run against references: the truth, paths of joints, points clicked by hand; other runs, other people.

`assess` gives errors; `evaluate_agreement` says how well they agree: bias, limits of agreement, ICC, repeatability.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from airborne.body import BodyModel
from airborne.body.symmetry import symmetries
from airborne.cameras import Rig, read_rig
from airborne.errors import ResultError
from airborne.evaluation import (
    Agreement,
    DigitisedComparison,
    JointComparison,
    MotionComparison,
    PlayersComparison,
    Repeatability,
    Series,
    analyse_agreement,
    analyse_repeatability,
    assess_players,
    compare_digitised,
    compare_joints,
    compare_motion,
    fit_digitised_poses,
    read_digitised,
    read_joint_paths,
    read_players_truth,
    read_truth,
)
from airborne.evaluation.agreement_tables import write_agreements, write_repeatability
from airborne.evaluation.agreement_text import agreement_table, methods_text, repeatability_table
from airborne.evaluation.jump_errors import pair_jumps
from airborne.evaluation.variables import (
    Variables,
    align_symmetry,
    common_series,
    headline_series,
    joint_path_variables,
    jump_series,
    motion_variables,
    players_variables,
    read_joint_angles,
    root_variables,
)
from airborne.export import write_figures, write_json, write_report
from airborne.export.analysis_figures import write_bland_altman, write_identity
from airborne.io.text import read_json
from airborne.motion import Motion, run_folder
from airborne.motion.run_folder import check_record, holds_players, read_body_run, read_players_run
from airborne.run.provenance import versions

Comparisons = Mapping[str, MotionComparison | DigitisedComparison | JointComparison | PlayersComparison]


def assess(folder: Path, truth: Path | None, digitised: Path | None, joints: Path | None = None) -> Comparisons:
    """Compare the run in a folder, and put the comparison into its summary; of one body into figures and report too.

    `joints` are paths of joints as `read_joint_paths` reads them. Raises ResultError where the folder holds no finished
    run or a file cannot be read.
    """
    if holds_players(folder):
        return _assess_players(folder, truth, is_alone=digitised is None and joints is None)
    if truth is None and digitised is None and joints is None:
        raise ResultError(
            "nothing to compare with; give a truth.csv, --digitised, --joints, --joint-angles, or --repeat with a run"
        )
    motion, model = read_body_run(folder)
    symmetry = symmetries(model)
    comparisons: dict[str, MotionComparison | DigitisedComparison | JointComparison] = {}
    true_poses = clicked = None
    if truth is not None:
        true_poses = read_truth(truth)
        comparisons["truth"] = compare_motion(motion, true_poses, symmetry)
    if digitised is not None:
        rig = read_rig(folder / run_folder.CALIBRATION)
        clicked = fit_digitised_poses(read_digitised(digitised, rig), rig, model)
        comparisons["digitised"] = compare_digitised(motion, clicked, symmetry)
    if joints is not None:
        comparisons["joints"] = compare_joints(motion, model, read_joint_paths(joints))
    summary = _add_to_summary(folder, comparisons)
    if summary and (folder / run_folder.REPORT).is_file():
        write_figures(
            run_folder.figures_of(folder), motion, model, truth=true_poses, digitised=clicked, symmetries=symmetry
        )
        write_report(folder, summary)
    return comparisons


def _assess_players(folder: Path, truth: Path | None, *, is_alone: bool) -> Comparisons:
    if truth is None or not is_alone:
        raise ResultError(
            f"{folder} holds a run of players, which is compared with a truth of players only; "
            "leave clicked points and joints out and give a truth.csv"
        )
    check_record(folder)
    comparisons = {"truth": assess_players(folder, truth)}
    _add_to_summary(folder, comparisons)
    return comparisons


def _add_to_summary(folder: Path, comparisons: Comparisons) -> dict:
    """Put comparisons into the run's summary and return it; {} where the run has none, or is not ours to write."""
    path = folder / run_folder.SUMMARY
    if not path.is_file() or not os.access(folder, os.W_OK):
        return {}
    try:
        summary = read_json(path)
    except (OSError, ValueError) as error:
        raise ResultError(f"{path} cannot be read ({str(error)[:120]}); correct it, or remove it") from None
    if not isinstance(summary, dict):
        raise ResultError(f"{path} holds no summary of a run; correct it, or remove it")
    summary |= {name: comparison.to_dict() for name, comparison in comparisons.items()}
    write_json(path, summary)
    return summary


@dataclass(frozen=True, slots=True, eq=False)
class AgreementReport:
    """Agreement by reference that the run was compared with; repeatability by what was repeated."""

    agreements: dict[str, list[Agreement]]
    repeats: dict[str, list[Repeatability]]
    headlines: frozenset[str]  # names of the headline variables
    folder: Path
    files: tuple[str, ...]  # in it

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers for a JSON file."""
        return {
            "agreement": {name: [row.to_dict() for row in rows] for name, rows in self.agreements.items()},
            "repeatability": {name: [row.to_dict() for row in rows] for name, rows in self.repeats.items()},
        }

    def describe(self) -> str:
        """Return the headline variables as short plain tables."""
        lines = []
        for name, rows in self.agreements.items():
            lines += [f"agreement with {name}", agreement_table([row for row in rows if row.name in self.headlines])]
        for name, rows in self.repeats.items():
            lines += [f"between {name}", repeatability_table([row for row in rows if row.name in self.headlines])]
        return "\n".join([*lines, f"wrote into {self.folder}: {', '.join(self.files)}"])


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
) -> AgreementReport:
    """Say how well the run in a folder agrees with references, and how well repetitions agree with one another.

    `repeats` are folders of other runs of the same trial; `operators` files of points that other people clicked in the
    pictures of `digitised`. Writes agreement.csv, repeatability.csv, figures and a methods paragraph into the run's
    folder, or into `out`. Raises ResultError where something is no run, cannot be read, or is of another recording.
    """
    if operators and digitised is None:
        raise ResultError("clicks of other people are compared with the first person's; give those as --digitised")
    _check_different("--repeat", (folder, *repeats), "another run")
    _check_different("--operator", (digitised or Path(), *operators), "another person's clicks")
    if holds_players(folder):
        if digitised or joints or joint_angles:
            raise ResultError(f"{folder} holds a run of players; give a truth.csv of players, or other runs of it")
        references, repeated = _players_series(folder, truth, repeats)
    else:
        references, repeated = _body_series(
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
    out = folder if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    first = frozenset(
        one.name for series in (*references.values(), *repeated.values()) for one in headline_series(series)
    )
    files = []
    if agreements:
        write_agreements(run_folder.tables_of(out) / "agreement.csv", agreements)
        files.append("tables/agreement.csv")
    if repeatable:
        write_repeatability(run_folder.tables_of(out) / "repeatability.csv", repeatable)
        files.append("tables/repeatability.csv")
    for name, series in references.items():
        word = name.split()[-1]
        plotted = [
            (one, row) for one, row in zip(series, agreements[name], strict=True) if one.name in first and row.n > 1
        ]
        if plotted:
            write_bland_altman(run_folder.figures_of(out) / f"agreement_{word}.png", plotted)
            write_identity(run_folder.figures_of(out) / f"identity_{word}.png", plotted)
            files += [f"figures/agreement_{word}.png", f"figures/identity_{word}.png"]
    text = methods_text(
        {name: [row for row in rows if row.name in first] for name, rows in agreements.items()},
        {name: [row for row in rows if row.name in first] for name, rows in repeatable.items()},
        versions(),
    )
    (out / "agreement_methods.txt").write_text(text, encoding="utf-8", newline="\n")
    return AgreementReport(agreements, repeatable, first, out, (*files, "agreement_methods.txt"))


def _check_different(option: str, paths: Sequence[Path], wanted: str) -> None:
    """Raise ResultError where one file or folder is given twice."""
    resolved = [path.resolve() for path in paths]
    for i, path in enumerate(paths):
        if resolved[i] in resolved[:i]:
            raise ResultError(f"{option} {path} would be compared with itself and agree perfectly; give {wanted}")


SeriesByReference = dict[str, list[Series]]


def _players_series(
    folder: Path, truth: Path | None, repeats: Sequence[Path]
) -> tuple[SeriesByReference, SeriesByReference]:
    motion = read_players_run(folder)
    own, references, repeated = players_variables(motion), SeriesByReference(), SeriesByReference()
    if truth is not None:
        true = read_players_truth(truth)
        players = [name for name in motion.players if name in true.players]
        series = common_series([own, players_variables(true)], "the run and its truth")
        pairs = pair_jumps(motion, true, players)
        references["the truth"] = series + (jump_series(pairs) if pairs else [])
    if repeats:
        others = [players_variables(read_players_run(other)) for other in repeats]
        repeated["runs"] = common_series([own, *others], "the runs")
    return references, repeated


def _body_series(
    folder: Path,
    truth: Path | None,
    *,
    digitised: Path | None,
    joints: Path | None,
    joint_angles: Path | None,
    repeats: Sequence[Path],
    operators: Sequence[Path],
) -> tuple[SeriesByReference, SeriesByReference]:
    motion, model = read_body_run(folder)
    symmetry, references, repeated = symmetries(model), SeriesByReference(), SeriesByReference()
    if truth is not None:
        true = read_truth(truth)
        aligned = align_symmetry(motion, true.R, true.time_s, symmetry)
        reference = root_variables(true.time_s, true.position, true.R)
        references["the truth"] = common_series(
            [root_variables(motion.time_s, motion.position, aligned), reference], "the run and its truth"
        )
    if joints is not None:
        paths = joint_path_variables(read_joint_paths(joints), model)
        references["the joints"] = common_series([motion_variables(motion, model), paths], "the run and the joints")
    if joint_angles is not None:
        true_angles = read_joint_angles(joint_angles)
        references["the joint angles"] = common_series(
            [motion_variables(motion, model), true_angles], "the run and the joint angles"
        )
    if digitised is not None:
        rig = read_rig(folder / run_folder.CALIBRATION)
        clicked = [
            _clicked_poses(path, rig, model, motion=motion, symmetry=symmetry) for path in (digitised, *operators)
        ]
        tracked = root_variables(motion.time_s, motion.position, clicked[0][1])
        references["points digitised"] = common_series([tracked, clicked[0][0]], "the run and the clicked points")
        if operators:
            repeated["operators"] = common_series([each for each, _ in clicked], "the people's clicks")
    if repeats:
        others = [read_body_run(other)[0] for other in repeats]
        same = [replace(each, R=align_symmetry(each, motion.R, motion.time_s, symmetry)) for each in others]
        repeated["runs"] = common_series([motion_variables(each, model) for each in (motion, *same)], "the runs")
    return references, repeated


def _clicked_poses(
    path: Path, rig: Rig, model: BodyModel, *, motion: Motion, symmetry: Sequence[np.ndarray]
) -> tuple[Variables, np.ndarray]:
    """Return one person's clicked poses at the motion's times, and the motion's R aligned with them by symmetry."""
    poses = fit_digitised_poses(read_digitised(path, rig), rig, model)
    _, frames, rows = np.intersect1d(motion.index, poses.index, return_indices=True)
    if not len(frames):
        raise ResultError(f"{path} has no frame of this run; give the clicks of this recording")
    time_s, R = motion.time_s[frames], poses.R[rows]
    return root_variables(time_s, poses.position[rows], R), align_symmetry(motion, R, time_s, symmetry)
