"""Lens distortion on normalised image coordinates: Brown and fisheye.

Brown is OpenCV's k1, k2, p1, p2, k3, and of the rational model k4, k5, k6 behind them; fisheye is its k1 to k4.
"""

from __future__ import annotations

import numpy as np

from airborne.types import Array

_N_STEPS = 20  # Newton steps; four are enough for ordinary lenses
_TOLERANCE = 1e-9  # a point still this far off lies where the lens model has no inverse


def distort(xy: Array, coefficients: Array) -> Array:
    """Distort normalised points (..., 2): (..., 2)."""
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial, _ = radial_factor(r2, coefficients)
    p1, p2 = (*coefficients, 0.0, 0.0, 0.0)[2:4]
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def radial_factor(r2: Array, coefficients: Array) -> tuple[Array, Array]:
    """Return the radial factor at squared radii r2, and twice its derivative by r2; coefficients are one to eight."""
    k1, k2, _, _, k3, *more = (*coefficients, 0.0, 0.0, 0.0, 0.0)[: max(len(coefficients), 5)]
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    derivative = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
    if not len(more):
        return radial, derivative
    k4, k5, k6 = more
    below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    derivative = (derivative - radial / below * 2 * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / below
    return radial / below, derivative


def undistort(xy: Array, coefficients: Array) -> Array:
    """Undistort normalised points (..., 2): (..., 2).

    The inverse of `distort` by Newton's method; NaN where a strong lens model folds back and has no inverse.
    """
    xy = np.asarray(xy, float)
    ideal = xy.copy()
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a diverging point ends as NaN below
        for _ in range(_N_STEPS):
            error = distort(ideal, coefficients) - xy
            ideal = ideal - np.einsum("...ij,...j->...i", _inverse_jacobian(ideal, coefficients), error)
            if np.all(np.abs(error) <= _TOLERANCE):
                break  # a step from there is exact to the last digits
        error = np.abs(distort(ideal, coefficients) - xy).max(axis=-1)
        is_before_fold = np.linalg.det(_inverse_jacobian(ideal, coefficients)) > 0
    is_solved = is_before_fold & (error <= _TOLERANCE * (1 + np.abs(xy).max(axis=-1)))
    return np.where(is_solved[..., None], ideal, np.nan)


def _inverse_jacobian(xy: Array, coefficients: Array) -> Array:
    """Return the inverse of the derivative of `distort` at xy (..., 2): (..., 2, 2)."""
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial, radial_derivative = radial_factor(r2, coefficients)
    p1, p2 = (*coefficients, 0.0, 0.0, 0.0)[2:4]
    xx = radial + x * x * radial_derivative + 2 * p1 * y + 6 * p2 * x
    yy = radial + y * y * radial_derivative + 6 * p1 * y + 2 * p2 * x
    xy_ = x * y * radial_derivative + 2 * p1 * x + 2 * p2 * y  # the derivative is symmetric
    determinant = xx * yy - xy_ * xy_
    return np.stack([np.stack([yy, -xy_], -1), np.stack([-xy_, xx], -1)], -2) / determinant[..., None, None]


def distort_fisheye(xy: Array, coefficients: Array) -> Array:
    """Distort pinhole points (..., 2) by a fisheye lens: (..., 2).

    A ray at the angle a from the axis is imaged at the radius `a + k1 a^3 + k2 a^5 + k3 a^7 + k4 a^9` (Kannala and
    Brandt 2006, as in OpenCV); coefficients (4,).
    """
    xy = np.asarray(xy, float)
    r = np.hypot(xy[..., 0], xy[..., 1])
    radius = _fisheye_radius(np.arctan(r), coefficients)
    return xy * np.where(r > 0, radius / np.where(r > 0, r, 1), 1)[..., None]


def undistort_fisheye(xy: Array, coefficients: Array) -> Array:
    """Undistort points (..., 2) of a fisheye lens: (..., 2).

    The inverse of `distort_fisheye`; NaN for rays 90 degrees and more from the axis, and where the lens folds back.
    """
    xy = np.asarray(xy, float)
    radius = np.hypot(xy[..., 0], xy[..., 1])
    angle = np.minimum(radius, 1.5)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a diverging point ends as NaN below
        for _ in range(_N_STEPS):
            angle = angle - (_fisheye_radius(angle, coefficients) - radius) / _fisheye_derivative(angle, coefficients)
        error = np.abs(_fisheye_radius(angle, coefficients) - radius)
        is_solved = (error <= _TOLERANCE * (1 + radius)) & (_fisheye_derivative(angle, coefficients) > 0)
        is_solved &= (angle >= 0) & (angle < np.pi / 2)
        scale = np.where(radius > 0, np.tan(angle) / radius, 1)
    return np.where(is_solved[..., None], xy * scale[..., None], np.nan)


def _fisheye_radius(angle: Array, coefficients: Array) -> Array:
    k1, k2, k3, k4 = coefficients[:4]
    a2 = angle * angle
    return angle * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))


def _fisheye_derivative(angle: Array, coefficients: Array) -> Array:
    k1, k2, k3, k4 = coefficients[:4]
    a2 = angle * angle
    return 1 + a2 * (3 * k1 + a2 * (5 * k2 + a2 * (7 * k3 + a2 * 9 * k4)))
