"""Smoothing: paths over time and their covariances come in; smooth paths, derivatives, events, cut-offs go out.

Arrays in, arrays out; no smoothing across boundaries between segments or across gaps that are not filled.
Independent of bodies, players and files.
"""

from airborne.motion.smoothing.boundaries import crossings, parabolic_peak
from airborne.motion.smoothing.butterworth import (
    butterworth_smoother,
    cutoff_correction,
    is_evenly_sampled,
    low_pass,
    pass_cutoff_hz,
)
from airborne.motion.smoothing.kalman import kalman_smoother
from airborne.motion.smoothing.residuals import ResidualAnalysis, residual_analysis
from airborne.motion.smoothing.rotations import SmoothedRotations, continuous_quaternions, smooth_rotations
from airborne.motion.smoothing.segments import SmoothedPaths, SmoothedSegments, Smoother, smooth_stretches
from airborne.motion.smoothing.splines import spline_smoother

__all__ = [
    "ResidualAnalysis",
    "SmoothedPaths",
    "SmoothedRotations",
    "SmoothedSegments",
    "Smoother",
    "butterworth_smoother",
    "continuous_quaternions",
    "crossings",
    "cutoff_correction",
    "is_evenly_sampled",
    "kalman_smoother",
    "low_pass",
    "parabolic_peak",
    "pass_cutoff_hz",
    "residual_analysis",
    "smooth_rotations",
    "smooth_stretches",
    "spline_smoother",
]
