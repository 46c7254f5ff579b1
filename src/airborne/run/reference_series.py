"""The time series of a run beside those of its references, of other runs and of other people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

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
)
from airborne.motion import Motion, run_folder
from airborne.motion.run_folder import read_body_run, read_players_run

SeriesByReference = dict[str, list[Series]]


def players_series(
    folder: Path, truth: Path | None, repeats: Sequence[Path]
) -> tuple[SeriesByReference, SeriesByReference]:
    """Return the series of players beside each reference, and beside repeated runs."""
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


def body_series(
    folder: Path,
    truth: Path | None,
    *,
    digitised: Path | None,
    joints: Path | None,
    joint_angles: Path | None,
    repeats: Sequence[Path],
    operators: Sequence[Path],
) -> tuple[SeriesByReference, SeriesByReference]:
    """Return the series of a body beside each reference, and of repeated runs or operators."""
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
            _poses_from_clicks(path, rig, model, motion=motion, symmetry=symmetry) for path in (digitised, *operators)
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


def _poses_from_clicks(
    path: Path, rig: Rig, model: BodyModel, *, motion: Motion, symmetry: Sequence[np.ndarray]
) -> tuple[Variables, np.ndarray]:
    """Return one person's clicked poses at the motion's times, and the motion's R aligned with them by symmetry."""
    poses = fit_digitised_poses(read_digitised(path, rig), rig, model)
    _, frames, rows = np.intersect1d(motion.index, poses.index, return_indices=True)
    if not len(frames):
        raise ResultError(f"{path} has no frame of this run; give the clicks of this recording")
    time_s, R = motion.time_s[frames], poses.R[rows]
    return root_variables(time_s, poses.position[rows], R), align_symmetry(motion, R, time_s, symmetry)
