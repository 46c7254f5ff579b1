"""A finished run against what is known: the truth, paths of joints, points clicked by hand; other runs, other people.

`assess` gives errors, `agree` says how well they agree: bias, limits of agreement, reliability, repeatability.
"""

from __future__ import annotations

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
    Comparison,
    DigitisedComparison,
    JointComparison,
    PlayersComparison,
    Repeatability,
    Series,
    agreement,
    assess_players,
    compare,
    compare_digitised,
    compare_joints,
    digitised_poses,
    read_digitised,
    read_joint_paths,
    read_players_truth,
    read_truth,
    repeatability,
)
from airborne.evaluation.agreement_tables import write_agreements, write_repeats
from airborne.evaluation.agreement_text import agreement_table, methods_text, repeatability_table
from airborne.evaluation.jump_errors import paired_jumps
from airborne.evaluation.variables import (
    Variables,
    headline,
    of_joint_paths,
    of_jumps,
    of_motion,
    of_players,
    of_root,
    read_joint_angles,
    side_by_side,
    turned_alike,
)
from airborne.export import write_figures, write_json, write_report
from airborne.export.analysis_figures import write_bland_altman, write_identity
from airborne.io.text import read_json
from airborne.motion import Motion
from airborne.motion.run_folder import body_run, check_record, holds_players, players_run
from airborne.run.opening import versions

Found = Mapping[str, Comparison | DigitisedComparison | JointComparison | PlayersComparison]


def assess(folder: Path, truth: Path | None, digitised: Path | None, joints: Path | None = None) -> Found:
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
    motion, model = body_run(folder)
    alike = symmetries(model)
    found: dict[str, Comparison | DigitisedComparison | JointComparison] = {}
    true_poses = clicked = None
    if truth is not None:
        true_poses = read_truth(truth)
        found["truth"] = compare(motion, true_poses, alike)
    if digitised is not None:
        rig = read_rig(folder / "calib.toml")
        clicked = digitised_poses(read_digitised(digitised, rig), rig, model)
        found["digitised"] = compare_digitised(motion, clicked, alike)
    if joints is not None:
        found["joints"] = compare_joints(motion, model, read_joint_paths(joints))
    summary = _kept(folder, found)
    if summary and (folder / "report.html").is_file():
        write_figures(folder, motion, model, truth=true_poses, digitised=clicked, symmetries=alike)
        write_report(folder, summary)
    return found


def _assess_players(folder: Path, truth: Path | None, *, is_alone: bool) -> Found:
    if truth is None or not is_alone:
        raise ResultError(
            f"{folder} holds a run of players, which is compared with a truth of players only; "
            "leave --digitised and --joints out and give a truth.csv"
        )
    check_record(folder)
    found = {"truth": assess_players(folder, truth)}
    _kept(folder, found)
    return found


def _kept(folder: Path, found: Found) -> dict:
    """Put comparisons into the run's summary and return it; {} where the run has none."""
    path = folder / "summary.json"
    if not path.is_file():
        return {}
    try:
        summary = read_json(path)
    except (OSError, ValueError) as error:
        raise ResultError(f"{path} cannot be read ({str(error)[:120]}); mend it, or remove it") from None
    if not isinstance(summary, dict):
        raise ResultError(f"{path} holds no summary of a run; mend it, or remove it")
    summary |= {name: comparison.to_dict() for name, comparison in found.items()}
    write_json(path, summary)
    return summary


@dataclass(frozen=True, slots=True, eq=False)
class Concord:
    """How well things agree, by what the run was compared with; and repeatability, by what was repeated."""

    agreements: dict[str, list[Agreement]]
    repeats: dict[str, list[Repeatability]]
    headlines: frozenset[str]  # names of the variables that stand first
    files: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers for a JSON file."""
        return {
            "agreement": {name: [row.to_dict() for row in rows] for name, rows in self.agreements.items()},
            "repeatability": {name: [row.to_dict() for row in rows] for name, rows in self.repeats.items()},
        }

    def describe(self) -> str:
        """Return the variables that stand first as short plain tables."""
        lines = []
        for name, rows in self.agreements.items():
            lines += [f"agreement with {name}", agreement_table([row for row in rows if row.name in self.headlines])]
        for name, rows in self.repeats.items():
            lines += [f"between {name}", repeatability_table([row for row in rows if row.name in self.headlines])]
        return "\n".join([*lines, f"wrote {', '.join(self.files)}"])


def agree(
    folder: Path,
    truth: Path | None = None,
    digitised: Path | None = None,
    joints: Path | None = None,
    *,
    joint_angles: Path | None = None,
    repeats: Sequence[Path] = (),
    operators: Sequence[Path] = (),
    out: Path | None = None,
) -> Concord:
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
        references, repeated = _body_series(folder, truth, digitised, joints, joint_angles, repeats, operators)
    agreements = {name: [agreement(one) for one in series] for name, series in references.items()}
    repeatable = {name: [repeatability(one) for one in series] for name, series in repeated.items()}
    out = folder if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    first = frozenset(one.name for series in (*references.values(), *repeated.values()) for one in headline(series))
    files = []
    if agreements:
        write_agreements(out / "agreement.csv", agreements)
        files.append("agreement.csv")
    if repeatable:
        write_repeats(out / "repeatability.csv", repeatable)
        files.append("repeatability.csv")
    for name, series in references.items():
        word = name.split()[-1]
        drawn = [
            (one, row) for one, row in zip(series, agreements[name], strict=True) if one.name in first and row.n > 1
        ]
        if drawn:
            write_bland_altman(out / f"agreement_{word}.png", drawn)
            write_identity(out / f"identity_{word}.png", drawn)
            files += [f"agreement_{word}.png", f"identity_{word}.png"]
    text = methods_text(
        {name: [row for row in rows if row.name in first] for name, rows in agreements.items()},
        {name: [row for row in rows if row.name in first] for name, rows in repeatable.items()},
        versions(),
    )
    (out / "agreement_methods.txt").write_text(text, encoding="utf-8", newline="\n")
    return Concord(agreements, repeatable, first, (*files, "agreement_methods.txt"))


def _check_different(option: str, paths: Sequence[Path], wanted: str) -> None:
    """Raise ResultError where one file or folder is given twice."""
    places = [path.resolve() for path in paths]
    for i, path in enumerate(paths):
        if places[i] in places[:i]:
            raise ResultError(f"{option} {path} would be compared with itself and agree perfectly; give {wanted}")


Compared = dict[str, list[Series]]


def _players_series(folder: Path, truth: Path | None, repeats: Sequence[Path]) -> tuple[Compared, Compared]:
    motion = players_run(folder)
    own, references, repeated = of_players(motion), Compared(), Compared()
    if truth is not None:
        true = read_players_truth(truth)
        players = [name for name in motion.players if name in true.players]
        series = side_by_side([own, of_players(true)], "the run and its truth")
        pairs = paired_jumps(motion, true, players)
        references["the truth"] = series + (of_jumps(pairs) if pairs else [])
    if repeats:
        others = [of_players(players_run(other)) for other in repeats]
        repeated["runs"] = side_by_side([own, *others], "the runs")
    return references, repeated


def _body_series(
    folder: Path,
    truth: Path | None,
    digitised: Path | None,
    joints: Path | None,
    joint_angles: Path | None,
    repeats: Sequence[Path],
    operators: Sequence[Path],
) -> tuple[Compared, Compared]:
    motion, model = body_run(folder)
    alike, references, repeated = symmetries(model), Compared(), Compared()
    if truth is not None:
        true = read_truth(truth)
        turned = turned_alike(motion, true.R, true.time_s, alike)
        reference = of_root(true.time_s, true.position, true.R)
        references["the truth"] = side_by_side(
            [of_root(motion.time_s, motion.position, turned), reference], "the run and its truth"
        )
    if joints is not None:
        paths = of_joint_paths(read_joint_paths(joints), model)
        references["the joints"] = side_by_side([of_motion(motion, model), paths], "the run and the joints")
    if joint_angles is not None:
        true_angles = read_joint_angles(joint_angles)
        references["the joint angles"] = side_by_side(
            [of_motion(motion, model), true_angles], "the run and the joint angles"
        )
    if digitised is not None:
        rig = read_rig(folder / "calib.toml")
        clicked = [_clicked(path, rig, model, motion, alike) for path in (digitised, *operators)]
        turned = of_root(motion.time_s, motion.position, clicked[0][1])
        references["points digitised"] = side_by_side([turned, clicked[0][0]], "the run and the clicked points")
        if operators:
            repeated["operators"] = side_by_side([each for each, _ in clicked], "the people's clicks")
    if repeats:
        others = [body_run(other)[0] for other in repeats]
        same = [replace(each, R=turned_alike(each, motion.R, motion.time_s, alike)) for each in others]
        repeated["runs"] = side_by_side([of_motion(each, model) for each in (motion, *same)], "the runs")
    return references, repeated


def _clicked(
    path: Path, rig: Rig, model: BodyModel, motion: Motion, alike: Sequence[np.ndarray]
) -> tuple[Variables, np.ndarray]:
    """Return one person's clicked poses at the motion's times, and the motion turned to look like them."""
    poses = digitised_poses(read_digitised(path, rig), rig, model)
    _, frames, rows = np.intersect1d(motion.index, poses.index, return_indices=True)
    if not len(frames):
        raise ResultError(f"{path} has no frame of this run; give the clicks of this recording")
    time_s, R = motion.time_s[frames], poses.R[rows]
    return of_root(time_s, poses.position[rows], R), turned_alike(motion, R, time_s, alike)
