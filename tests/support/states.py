"""Trackers' states as values: what they hold, however deep, as one list."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation


def leaves(state: Any) -> list[Any]:
    """Copies of all arrays and the numbers, names and types that a state holds, in order."""
    if isinstance(state, np.ndarray):
        return [state.copy()]
    if isinstance(state, Rotation | RigidTransform):
        return [state.as_matrix()]
    if is_dataclass(state):
        inner = [getattr(state, field.name) for field in fields(state)]
    elif isinstance(state, Mapping):
        inner = [*state, *state.values()]
    elif isinstance(state, list | tuple):
        inner = list(state)
    else:
        return [state]
    return [type(state), *(leaf for each in inner for leaf in leaves(each))]


def assert_same(a: list[Any], b: list[Any]) -> None:
    """Assert that the leaves of two states are equal to the last bit."""
    assert len(a) == len(b)
    for one, other in zip(a, b, strict=True):
        np.testing.assert_array_equal(one, other)
