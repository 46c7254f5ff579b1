"""A paper's experiment made anew: in comes nothing but choices, out comes its table beside ours; reads no recording."""

from airborne.reproduction.block.experiment import reproduce_blockjump
from airborne.reproduction.rigid.curves import Curve, convergence, half_width
from airborne.reproduction.rigid.experiment import reproduce_rigid
from airborne.reproduction.rigid.sensitivity import CASES, Case
from airborne.reproduction.rigid.somersaults import METHODS, Errors, Experiment, experiment, tracked

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
