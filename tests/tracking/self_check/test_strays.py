"""A pose that leaves the path of those around it and looks less like its pictures is a stray, at either end too."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.tracking.self_check.strays import find_strays
from tests.support.thrown_paths import N, thrown_path


def scores(rows=(), factor=1.3):
    found = np.full(N, 8.0)
    found[list(rows)] *= factor
    return found


def moved(path, rows, move):
    poses = list(path.poses)
    for row in rows:
        poses[row] = replace(poses[row], world_from_root=move(poses[row].world_from_root))
    return replace(path, poses=poses)


def shifted(at):
    return RigidTransform.from_translation([0.0, 0.05, 0.0]) * at


def turned(at):
    return at * RigidTransform.from_rotation(Rotation.from_rotvec([0.1, 0.0, 0.0]))


@pytest.mark.parametrize("move", [shifted, turned])
@pytest.mark.parametrize("rows", [[1], [20], [10, 30, 50]])
def test_strays_are_found(move, rows):
    path = moved(thrown_path(0.2, 0.2), rows, move)
    assert np.flatnonzero(find_strays(path, scores(rows))).tolist() == rows


def test_one_that_looks_like_its_pictures_is_none():
    path = moved(thrown_path(0.2, 0.2), [20], shifted)
    assert not find_strays(path, scores()).any()


@pytest.mark.parametrize("seed", range(5))
def test_errors_as_stated_or_larger_make_none_whatever_the_scores(seed):
    rng = np.random.default_rng(seed)
    assert not find_strays(thrown_path(4, 4, seed=seed), 8 * np.exp(rng.normal(0, 0.3, N))).any()


def test_frames_that_are_missing_make_none():
    path = thrown_path(0.2, 0.2)
    kept = np.r_[0:10, 40:N]
    short = replace(
        path, index=path.index[kept], time_s=path.time_s[kept], poses=[path.poses[k] for k in kept],
        covariance=path.covariance[kept],
    )  # fmt: skip
    assert not find_strays(short, scores([9, 40])[kept]).any()


def test_a_few_poses_tell_nothing():
    path = thrown_path()
    few = replace(path, index=path.index[:5], time_s=path.time_s[:5], poses=path.poses[:5])
    assert not find_strays(few, scores([2])[:5]).any()
