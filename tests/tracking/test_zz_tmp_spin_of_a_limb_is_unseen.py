"""A round limb's turn about its own axis cannot be seen: no number is given for it, and it stays as it was."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.body import BodyModel, Ellipsoid, Part
from airborne.body.chain import motion_between
from tests.tracking.scenes import FIGURE, Scene, standing, statuses, track

ROUND = ("lower_left", "lower_right", "leg")  # limbs that carry nothing


def rounded(part: Part) -> Part:
    x, _, z = part.shape.semi_axes_m
    return replace(part, shape=Ellipsoid(np.array([x, x, z])))


ROUND_FIGURE = BodyModel(
    "figure with round limbs",
    tuple(
        replace(each, parts=tuple(map(rounded, each.parts))) if each.name in ROUND else each for each in FIGURE.segments
    ),
)
STILL = Scene(ROUND_FIGURE, lambda time_s: standing(Fraction(0)))
MOVING = Scene(ROUND_FIGURE, standing)


@pytest.fixture(scope="module", params=["still", "moving"])
def run(request):
    scene = {"still": STILL, "moving": MOVING}[request.param]
    return scene, track(scene, range(8))


def columns(name: str) -> np.ndarray:
    return 3 + 3 * ROUND_FIGURE.index_of(name) + np.arange(3)


def axis(pose, name: str) -> np.ndarray:
    """Where a limb points in the world."""
    return ROUND_FIGURE.with_pose(pose).R[ROUND_FIGURE.index_of(name), :, 2]


def test_round_limbs_point_where_they_do_in_truth(run):
    scene, estimates = run
    assert statuses(estimates) == ["tracked"] * 8
    for estimate in estimates:
        for name in ROUND:
            off = axis(estimate.pose, name) @ axis(scene.start(estimate.index), name)
            assert np.degrees(np.arccos(min(off, 1))) < 4


def test_spin_of_a_round_limb_has_an_infinite_variance_and_its_direction_a_small_one(run):
    for estimate in run[1]:
        for name in ROUND:
            x, y, z = np.diag(estimate.covariance)[columns(name)]
            assert max(x, y) < np.radians(15) ** 2
            assert np.isinf(z)


def test_unseen_spin_does_not_drift(run):
    scene, estimates = run
    turn = motion_between(estimates[0].pose, estimates[-1].pose) - motion_between(scene.start(0), scene.start(7))
    for name in ROUND:
        assert abs(turn[columns(name)[2]]) < np.radians(6)
