"""Reproductions of two papers' synthetic experiments: settings in, their tables beside ours out; no recordings."""

from airborne.reproduction.block.experiment import reproduce_blockjump
from airborne.reproduction.rigid.curves import Curve, half_width, score_curves
from airborne.reproduction.rigid.experiment import reproduce_rigid
from airborne.reproduction.rigid.sensitivity import CASES, Case
from airborne.reproduction.rigid.somersaults import (
    RIGID_METHODS,
    Experiment,
    RunErrors,
    make_experiment,
    track_experiment,
)

__all__ = [
    "CASES",
    "RIGID_METHODS",
    "Case",
    "Curve",
    "Experiment",
    "RunErrors",
    "half_width",
    "make_experiment",
    "reproduce_blockjump",
    "reproduce_rigid",
    "score_curves",
    "track_experiment",
]
