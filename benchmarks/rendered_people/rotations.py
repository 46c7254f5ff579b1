"""Rotation matrices (3, 3); angles in degrees, vectors of rotation in radians."""

from __future__ import annotations

import numpy as np


def about_x(angle_deg: float) -> np.ndarray:
    """Return the rotation about x."""
    a = np.radians(angle_deg)
    c, s = np.cos(a), np.sin(a)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def about_y(angle_deg: float) -> np.ndarray:
    """Return the rotation about y."""
    a = np.radians(angle_deg)
    c, s = np.cos(a), np.sin(a)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def about_z(angle_deg: float) -> np.ndarray:
    """Return the rotation about z."""
    a = np.radians(angle_deg)
    c, s = np.cos(a), np.sin(a)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def rotation_of(vector: np.ndarray) -> np.ndarray:
    """Return the rotation of a vector of rotation (3,) [rad]: Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def rotation_vector_of(R: np.ndarray) -> np.ndarray:
    """Return the vector of rotation (3,) [rad] of a rotation that is neither none nor a half turn."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return vector / np.linalg.norm(vector) * np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))


def rotation_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the smallest rotation that turns one direction (3,) into another."""
    a, b = one / np.linalg.norm(one), other / np.linalg.norm(other)
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis)
    return rotation_of(axis / sine * np.arctan2(sine, a @ b)) if sine > 1e-9 else np.eye(3)
