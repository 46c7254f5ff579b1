"""The time series of a run beside those of its references, of other runs and of other people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from airborne.body import BodyModel
from airborne.body.symmetry import symmetries
from airborne.cameras import Rig, read_rig
from airborne.errors import ResultError
from airborne.evaluation import (
    Series,
    fit_digitised_poses,
    read_digitised,
    read_joint_paths,
    read_players_truth,
    read_truth,
)
from airborne.evaluation.jump_errors import pair_jumps
from airborne.evaluation.players_questions import name_by_place
from airborne.evaluation.variables import (
    Variables,
    align_symmetry,
    common_series,
    joint_path_variables,
    jump_series,
    motion_variables,
    players_variables,
    read_joint_angles,
    root_variables,
    unknown_markers,
)
from airborne.motion import Motion, run_folder
from airborne.motion.run_folder import read_body_run, read_players_run
from airborne.types import Array

SeriesByReference = dict[str, list[Series]]


def players_series(
    folder: Path, truth: Path | None, repeats: Sequence[Path]
) -> tuple[SeriesByReference, SeriesByReference]:
    """Return the series of players beside each reference, and beside repeated runs."""
    motion = read_players_run(folder)
    own, references, repeated = players_variables(motion), SeriesByReference(), SeriesByReference()
    if truth is not None:
        true = read_players_truth(truth)
        motion = name_by_place(motion, true)
        players = [name for name in motion.players if name in true.players]
        series = common_series([players_variables(motion), players_variables(true)], "the run and its truth")
        pairs = pair_jumps(motion, true, players)
        references["the truth"] = series + (jump_series(pairs) if pairs else [])
    if repeats:
        others = [players_variables(read_players_run(other)) for other in repeats]
        repeated["runs"] = common_series([own, *others], "the runs")
    return references, repeated


def body_series(
    folder: Path,
    truth: Path | None,
    *,
    digitised: Path | None,
    joints: Path | None,
    joint_angles: Path | None,
    repeats: Sequence[Path],
    operators: Sequence[Path],
) -> tuple[SeriesByReference, SeriesByReference, list[str]]:
    """Return the series of a body beside each reference, and of repeated runs or operators; and points left out."""
    motion, model = read_body_run(folder)
    symmetry, references, repeated = symmetries(model), SeriesByReference(), SeriesByReference()
    left_out: list[str] = []
    if truth is not None:
        true = read_truth(truth)
        aligned = align_symmetry(motion, true.R, true.time_s, symmetry)
        reference = root_variables(true.time_s, true.position, true.R)
        references["the truth"] = common_series(
            [root_variables(motion.time_s, motion.position, aligned), reference], "the run and its truth"
        )
    if joints is not None:
        read = read_joint_paths(joints)
        left_out += unknown_markers(read, model)
        paths = joint_path_variables(read, model)
        references["the joints"] = common_series([motion_variables(motion, model), paths], "the run and the joints")
    if joint_angles is not None:
        true_angles = read_joint_angles(joint_angles)
        references["the joint angles"] = common_series(
            [motion_variables(motion, model), true_angles], "the run and the joint angles"
        )
    if digitised is not None:
        rig = read_rig(folder / run_folder.CALIBRATION)
        clicked = [
            _poses_from_clicks(path, rig, model, motion=motion, symmetry=symmetry) for path in (digitised, *operators)
        ]
        tracked = root_variables(motion.time_s, motion.position, clicked[0].R)
        references["points digitised"] = common_series([tracked, clicked[0].poses], "the run and the clicked points")
        left_out += dict.fromkeys(name for each in clicked for name in each.left_out)
        if operators:
            repeated["operators"] = common_series([each.poses for each in clicked], "the people's clicks")
    if repeats:
        others = [read_body_run(other)[0] for other in repeats]
        same = [replace(each, R=align_symmetry(each, motion.R, motion.time_s, symmetry)) for each in others]
        repeated["runs"] = common_series([motion_variables(each, model) for each in (motion, *same)], "the runs")
    return references, repeated, left_out


class _ClickedPoses(NamedTuple):
    """One person's clicked poses at the motion's times."""

    poses: Variables
    R: Array  # (n, 3, 3) of the motion, aligned with them by symmetry
    left_out: tuple[str, ...]  # points


def _poses_from_clicks(
    path: Path, rig: Rig, model: BodyModel, *, motion: Motion, symmetry: Sequence[np.ndarray]
) -> _ClickedPoses:
    """Fit the body to one person's clicks. Raises ResultError for those of another recording."""
    poses = fit_digitised_poses(read_digitised(path, rig), rig, model)
    _, frames, rows = np.intersect1d(motion.index, poses.index, return_indices=True)
    if not len(frames):
        raise ResultError(f"{path} has no frame of this run; give the clicks of this recording")
    time_s, R = motion.time_s[frames], poses.R[rows]
    aligned = align_symmetry(motion, R, time_s, symmetry)
    return _ClickedPoses(root_variables(time_s, poses.position[rows], R), aligned, poses.left_out)
