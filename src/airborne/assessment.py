"""A finished run against what is known: the truth, paths of joints, or points clicked by hand."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from airborne.body.files import read_body
from airborne.body.symmetry import symmetries
from airborne.cameras import read_rig
from airborne.errors import ResultError
from airborne.evaluation import (
    Comparison,
    DigitisedComparison,
    JointComparison,
    PlayersComparison,
    assess_players,
    compare,
    compare_digitised,
    compare_joints,
    digitised_poses,
    read_digitised,
    read_joint_paths,
    read_truth,
)
from airborne.export import write_figures, write_json, write_report
from airborne.motion import read_motion

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
            "nothing to compare with; give a truth.csv, --digitised with clicked points, or --joints with their paths"
        )
    if not (folder / "motion.csv").is_file():
        raise ResultError(f"{folder} holds no run; expected the output folder of `airborne track`")
    motion, model = read_motion(folder / "motion.csv"), read_body(folder / "body.toml")
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


def holds_players(folder: Path) -> bool:
    """Say whether a folder holds a run of several players, finished or not."""
    return (folder / "joints.csv").is_file() and not (folder / "motion.csv").is_file()


def _assess_players(folder: Path, truth: Path | None, *, is_alone: bool) -> Found:
    if truth is None or not is_alone:
        raise ResultError(
            f"{folder} holds a run of players, which is compared with a truth of players only; "
            "leave --digitised and --joints out and give a truth.csv"
        )
    found = {"truth": assess_players(folder, truth)}
    _kept(folder, found)
    return found


def _kept(folder: Path, found: Found) -> dict:
    """Put comparisons into the run's summary and return it; {} where the run has none."""
    path = folder / "summary.json"
    if not path.is_file():
        return {}
    summary = json.loads(path.read_text(encoding="utf-8"))
    summary |= {name: comparison.to_dict() for name, comparison in found.items()}
    write_json(path, summary)
    return summary
