"""Signals: in come paths over time with their covariances, out come smooth ones, derivatives, events, cut-offs.

Arrays in, arrays out; nothing reaches across a boundary between segments or a gap that is not to be filled.
Knows no body, no player and no file.
"""

from airborne.motion.smoothing.boundaries import crossings, highest
from airborne.motion.smoothing.butterworth import butterworth, correction, is_even, low_pass, pass_cutoff_hz
from airborne.motion.smoothing.kalman import kalman
from airborne.motion.smoothing.residuals import ResidualAnalysis, residual_analysis
from airborne.motion.smoothing.rotations import SmoothedRotations, continuous_quaternions, smooth_rotations
from airborne.motion.smoothing.segments import Pieces, Smoothed, Smoother, in_stretches
from airborne.motion.smoothing.splines import spline

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
