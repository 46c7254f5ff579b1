"""Evaluation: in come a `Motion` and what is known to be true, out come errors with their units, and agreement.

Truth is a table of poses, paths of joints, points clicked by hand (paper B), joints and jumps of several players, or
a known pose that a search has to find again.
Knows no image and no search.
"""

from airborne.evaluation.agreement import Agreement, Series, agreement
from airborne.evaluation.basin import Basin, is_recovered, perturbed
from airborne.evaluation.compare import Calibration, Comparison, OrientationErrors, PositionErrors, compare
from airborne.evaluation.digitised import (
    Digitised,
    DigitisedComparison,
    DigitisedPoses,
    compare_digitised,
    digitised_poses,
    read_clicked_frames,
    read_digitised,
    write_clicked_frames,
)
from airborne.evaluation.icc import Reliability, reliability
from airborne.evaluation.joint_files import JointPaths, landmark_of, read_joint_paths
from airborne.evaluation.joints import JointComparison, JointErrors, compare_joints
from airborne.evaluation.players import PlayerErrors, PlayersComparison, assess_players, compare_players
from airborne.evaluation.players_truth import read_players_truth
from airborne.evaluation.repeatability import Repeatability, repeatability
from airborne.evaluation.truth import Truth, read_truth

__all__ = [
    "Agreement",
    "Basin",
    "Calibration",
    "Comparison",
    "Digitised",
    "DigitisedComparison",
    "DigitisedPoses",
    "JointComparison",
    "JointErrors",
    "JointPaths",
    "OrientationErrors",
    "PlayerErrors",
    "PlayersComparison",
    "PositionErrors",
    "Reliability",
    "Repeatability",
    "Series",
    "Truth",
    "agreement",
    "assess_players",
    "compare",
    "compare_digitised",
    "compare_joints",
    "compare_players",
    "digitised_poses",
    "is_recovered",
    "landmark_of",
    "perturbed",
    "read_clicked_frames",
    "read_digitised",
    "read_joint_paths",
    "read_players_truth",
    "read_truth",
    "reliability",
    "repeatability",
    "write_clicked_frames",
]
