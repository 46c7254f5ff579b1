"""A round limb's turn about its own axis cannot be seen; where the limb points can."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.body import BodyModel, Ellipsoid, Part
from tests.support.scenes import FIGURE, Scene, standing, statuses, track

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
