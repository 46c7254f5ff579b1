"""Signals: in come paths over time with their covariances, out come smooth ones, derivatives, events, cut-offs.

Arrays in, arrays out; nothing reaches across a boundary between segments or a gap that is not to be filled.
Knows no body, no player and no file.
"""

from airborne.motion.signals.butterworth import butterworth, correction, is_even, low_pass, pass_cutoff_hz
from airborne.motion.signals.events import crossings, highest
from airborne.motion.signals.kalman import kalman
from airborne.motion.signals.residuals import ResidualAnalysis, residual_analysis
from airborne.motion.signals.rotations import SmoothedRotations, continuous_quaternions, smooth_rotations
from airborne.motion.signals.splines import spline
from airborne.motion.signals.stretches import Pieces, Smoothed, Smoother, in_stretches

__all__ = [
    "Pieces",
    "ResidualAnalysis",
    "Smoothed",
    "SmoothedRotations",
    "Smoother",
    "butterworth",
    "continuous_quaternions",
    "correction",
    "crossings",
    "highest",
    "in_stretches",
    "is_even",
    "kalman",
    "low_pass",
    "pass_cutoff_hz",
    "residual_analysis",
    "smooth_rotations",
    "spline",
]
