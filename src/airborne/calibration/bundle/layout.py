"""Where the derivatives of every observation go in the normal equations: the same at every step of an adjustment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from airborne.calibration.bundle.lenses import N_PARAMETERS
from airborne.calibration.bundle.source import FreeParameters
from airborne.cameras.camera import Rig
from airborne.types import Array, Ints


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """The places of a square sparse matrix that may differ from zero, the whole diagonal among them."""

    indices: Ints  # (z,) rows, column by column
    indptr: Ints  # (o + 1,)
    diagonal: Ints  # (o,) places of the diagonal among the values
    blocks: Ints  # places of the blocks' entries, flat, and last of the lags'; z: nowhere

    @classmethod
    def of(cls, n: int, blocks: list[Ints]) -> Pattern:
        """Find the places of the pairs of columns of each block (b, q), -1 nowhere, of a matrix (n, n)."""
        keys = [_pairs(columns, columns, (n, n)).ravel() for columns in blocks]
        places, place = np.unique(np.concatenate([*keys, np.arange(n) * (n + 1), [n * n]]), return_inverse=True)
        places, n_entries = places[:-1], len(place) - n - 1  # the last is nowhere
        return cls(
            indices=places % max(n, 1),
            indptr=np.searchsorted(places, np.arange(n + 1) * n),
            diagonal=place[n_entries:-1],
            blocks=place[:n_entries],
        )

    def matrix(self, blocks: list[Array]) -> csc_array:
        """Return the sum of blocks (b, q, q), in the order in which they were given."""
        n, values = len(self.diagonal), np.concatenate([np.zeros(0), *(block.ravel() for block in blocks)])
        data = _sum_at(self.blocks, values, len(self.indices))
        return csc_array((data, self.indices, self.indptr), shape=(n, n))


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """The columns of the normal equations that each row of the Jacobian has entries in; -1: none, as it is fixed.

    Observations of one camera and of one target or point are a group: they have the same columns.
    """

    n_camera_columns: int
    parameters: Ints  # (p,) which of `lenses.CAMERA_PARAMETERS` are free in some camera
    cameras: Ints  # (cameras, p) columns of the cameras' parameters
    other_parameters: Ints  # (q,) which of a row's seven in `columns_of_rows` are free in some row
    other: Ints  # (n, q) columns of each observation's target or point and lag
    ends: Ints  # (k, 6) columns of each length's ends
    order: Ints  # (n,) the observations, group by group
    starts: Ints  # (g,) where each group begins in that order
    camera_starts: Ints  # (cameras + 1,) where each camera's observations begin in it, and the end
    camera_of_group: Ints  # (g,)
    coupling: Ints  # (g, p, q) places in the flat matrix (camera columns, other columns); past its end: nowhere
    lags: Ints  # (l,) columns
    others: Pattern  # blocks: of the groups, of the lengths, of the lags

    @classmethod
    def of(cls, camera: Ints, *, camera_columns: Ints, other: Ints, ends: Ints, lags: Ints, n_others: int) -> Layout:
        """Group the observations by camera (n,) and by other (n, 7), from `columns_of_rows`.

        camera_columns (cameras, 18), ends (k, 6), lags (l,).
        """
        n_camera_columns = int(camera_columns.max(initial=-1)) + 1
        columns = camera_columns.copy()
        columns[columns[:, 7] == columns[:, 6], 7] = -1  # with square pixels fy goes with fx
        parameters = np.flatnonzero((columns >= 0).any(axis=0))
        cameras = columns[:, parameters]
        other_parameters = np.flatnonzero((other >= 0).any(axis=0))
        other = other[:, other_parameters]
        order = np.lexsort((*other.T, camera))
        same = np.concatenate([other, camera[:, None]], axis=1)[order]
        is_first = np.append(True, (same[1:] != same[:-1]).any(axis=1))[: len(order)]
        starts = np.flatnonzero(is_first)
        camera_of_group, other_of_group = camera[order[starts]], other[order[starts]]
        return cls(
            n_camera_columns=n_camera_columns,
            parameters=parameters,
            cameras=cameras,
            other_parameters=other_parameters,
            other=other,
            ends=ends,
            order=order,
            starts=starts,
            camera_starts=np.searchsorted(camera[order], np.arange(len(cameras) + 1)),
            camera_of_group=camera_of_group,
            coupling=_pairs(cameras[camera_of_group], other_of_group, (n_camera_columns, n_others)),
            lags=lags,
            others=Pattern.of(n_others, [other_of_group, ends, lags[:, None]]),
        )

    @property
    def n_other_columns(self) -> int:
        """How many columns targets, points and lags have."""
        return len(self.others.diagonal)

    def sum_groups(self, values: Array) -> Array:
        """Return the sums (g, ...) of each group's values (n, ...)."""
        return np.add.reduceat(values[self.order], self.starts, axis=0)

    def couple(self, groups: Array) -> Array:
        """Return the sum (camera columns, other columns) of blocks (g, p, q)."""
        c, o = self.n_camera_columns, self.n_other_columns
        return _sum_at(self.coupling, groups, c * o).reshape(c, o)

    def sum_cameras(self, values: Array) -> Array:
        """Return the sums (camera columns,) of values (n, p) by the cameras' parameters."""
        n = self.n_camera_columns  # where -1 goes, nowhere
        return _sum_at(self.cameras[self.camera_of_group] % (n + 1), self.sum_groups(values), n)

    def sum_others(self, values: Array, ends: Array, lags: Array) -> Array:
        """Return the sums (other columns,) of values (n, q), of lengths' (k, 6) and of lags' (l,)."""
        n, columns = self.n_other_columns, np.concatenate([each.ravel() for each in (self.other, self.ends, self.lags)])
        return _sum_at(columns % (n + 1), np.concatenate([values.ravel(), ends.ravel(), lags]), n)


def number_parameters(rig: Rig, free_parameters: Mapping[str, FreeParameters]) -> Ints:
    """Return the columns of the cameras' free parameters (cameras, 18), -1 of what is fixed; some may share one."""
    columns = np.full((len(rig), N_PARAMETERS), -1)
    shared: dict[str, int] = {}
    n = 0
    for row, camera in zip(columns, rig, strict=True):
        own = free_parameters[camera.name]
        for number in own.parameters(camera.lens):
            if number in (6, 7) and own.shares_focal:
                key = f"{own.shares_focal} {number}"
                if key in shared:
                    row[number] = shared[key]
                    continue
                shared[key] = n
            row[number] = n
            n += 1
        if own.focal and own.square_pixels:
            row[7] = row[6]
    return columns


def columns_of_rows(moment: Ints, point: Ints, lag: Ints, *, of_target: Ints, of_point: Ints, of_lag: Ints) -> Ints:
    """Return the columns (n, 7) of each observation: six of its target, or three of its point, and one of its lag."""
    columns = np.full((len(point), 7), -1)
    on_target, is_late = moment >= 0, lag >= 0
    columns[on_target, :6] = of_target[moment[on_target]]
    columns[~on_target, :3] = of_point[point[~on_target]]
    columns[is_late, 6] = of_lag[lag[is_late]]
    return columns


def _pairs(left: Ints, right: Ints, shape: tuple[int, int]) -> Ints:
    """Return the places (b, p, q) in a flat matrix of all pairs of a row (b, p) and a column (b, q).

    -1 in either: past the end, nowhere.
    """
    left, right = left[:, :, None], right[:, None, :]
    return np.where((left < 0) | (right < 0), shape[0] * shape[1], left * shape[1] + right)


def _sum_at(places: Ints, values: Array, n: int) -> Array:
    """Return the sums (n,) of values at places; n: nowhere."""
    return np.asarray(np.bincount(places.ravel(), values.ravel(), minlength=n + 1)[:n], float)
