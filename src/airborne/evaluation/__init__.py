"""Evaluation: a `Motion` and a reference come in; errors with their units, and agreement, go out.

A reference is a table of true poses, paths of joints, a flight, digitised points (paper B), joints and jumps of several
players, or a known pose that a search has to recover.
Independent of images and searches.
"""

from airborne.evaluation.agreement import Agreement, Series, analyse_agreement
from airborne.evaluation.basin import Basin, is_recovered, perturb
from airborne.evaluation.compare import (
    MotionComparison,
    OrientationErrors,
    PositionErrors,
    SdCalibration,
    compare_motion,
)
from airborne.evaluation.digitised import (
    DigitisedComparison,
    DigitisedPoints,
    DigitisedPoses,
    box_ends,
    compare_digitised,
    describe_left_out,
    fit_digitised_poses,
    format_clicked_frames,
    read_clicked_frames,
    read_digitised,
    write_clicked_frames,
)
from airborne.evaluation.flight import FlightComparison, FlightErrors, FlightPaths, compare_flight, read_flight_paths
from airborne.evaluation.icc import Reliability, reliability
from airborne.evaluation.joint_files import JointPaths, landmark_of, read_joint_paths
from airborne.evaluation.joints import JointComparison, JointErrors, compare_joints
from airborne.evaluation.players import PlayerErrors, PlayersComparison, assess_players, compare_players
from airborne.evaluation.players_truth import read_players_truth
from airborne.evaluation.repeatability import Repeatability, analyse_repeatability
from airborne.evaluation.truth import Truth, read_truth

__all__ = [
    "Agreement",
    "Basin",
    "DigitisedComparison",
    "DigitisedPoints",
    "DigitisedPoses",
    "FlightComparison",
    "FlightErrors",
    "FlightPaths",
    "JointComparison",
    "JointErrors",
    "JointPaths",
    "MotionComparison",
    "OrientationErrors",
    "PlayerErrors",
    "PlayersComparison",
    "PositionErrors",
    "Reliability",
    "Repeatability",
    "SdCalibration",
    "Series",
    "Truth",
    "analyse_agreement",
    "analyse_repeatability",
    "assess_players",
    "box_ends",
    "compare_digitised",
    "compare_flight",
    "compare_joints",
    "compare_motion",
    "compare_players",
    "describe_left_out",
    "fit_digitised_poses",
    "format_clicked_frames",
    "is_recovered",
    "landmark_of",
    "perturb",
    "read_clicked_frames",
    "read_digitised",
    "read_flight_paths",
    "read_joint_paths",
    "read_players_truth",
    "read_truth",
    "reliability",
    "write_clicked_frames",
]
