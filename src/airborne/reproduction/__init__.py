"""A paper's experiment made anew: in comes nothing but choices, out comes its table beside ours; reads no recording."""

from airborne.reproduction.block_jump import reproduce_blockjump
from airborne.reproduction.curves import Curve, convergence, half_width
from airborne.reproduction.rigid import reproduce_rigid
from airborne.reproduction.sensitivity import CASES, Case
from airborne.reproduction.somersaults import METHODS, Errors, Experiment, experiment, tracked

__all__ = [
    "CASES",
    "METHODS",
    "Case",
    "Curve",
    "Errors",
    "Experiment",
    "convergence",
    "experiment",
    "half_width",
    "reproduce_blockjump",
    "reproduce_rigid",
    "tracked",
]
