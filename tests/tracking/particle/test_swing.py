"""Swinging rods keep their lengths, their sides and their reach."""

import numpy as np
import pytest

from airborne.tracking.particle.swing import SECTORS, draw_directions, draw_length_changes, reach, swing_rods
from tests.support.tolerances import EXACT, ROUNDTRIP, sampled

N = 4000
OUTWARD = np.array([1.0, 0.0])


def case(offset_m, seed=0):
    """Points near the ends of rods from a start, with steps and changed lengths."""
    rng = np.random.default_rng(seed)
    start = np.array([0.3, -0.2, 0.6])
    before = start + np.array([offset_m, 0, -0.4]) + rng.normal(0, 0.01, (N, 3))
    steps = draw_directions(rng, N) * rng.uniform(0, 0.1, (N, 1))
    return before, start, steps, 0.45 + rng.normal(0, 0.02, N)


@pytest.mark.parametrize("offset_m", [0.0, 0.2, 0.3, 0.6])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_consistent_rod_has_its_length_wherever_it_points(offset_m, side):
    before, start, steps, lengths_m = case(offset_m)
    end = swing_rods(before, start, steps, lengths_m=lengths_m, side=np.full(N, side), swing="consistent")
    assert np.allclose(np.linalg.norm(end - start, axis=1), lengths_m, atol=ROUNDTRIP)
    assert (np.sign(end[:, 2] - start[2]) == side).all()


def test_both_forms_are_one_where_the_point_was_straight_under_its_start():
    _, start, steps, lengths_m = case(0.0)
    before = np.tile(start - [0, 0, 0.45], (N, 1))
    literal, consistent = (
        swing_rods(before, start, steps, lengths_m=lengths_m, side=np.full(N, -1.0), swing=s)
        for s in ("literal", "consistent")
    )
    assert np.allclose(literal, consistent, atol=EXACT)


def test_the_literal_form_is_the_printed_equation():
    before, start, steps, lengths_m = case(0.3)
    end = swing_rods(before, start, steps, lengths_m=lengths_m, side=np.full(N, -1.0), swing="literal")
    assert np.allclose(end[:, :2], before[:, :2] + steps, atol=EXACT)
    assert np.allclose(end[:, 2], start[2] - np.sqrt(lengths_m**2 - np.sum(steps**2, axis=1)), atol=EXACT)
    too_long_m = np.linalg.norm(end - start, axis=1) - lengths_m
    assert too_long_m.mean() == pytest.approx(0.09, abs=0.015), "which is why it is not the default"


def test_points_within_reach_go_where_their_step_takes_them():
    before, start, steps, lengths_m = case(0.1)
    end = swing_rods(before, start, steps, lengths_m=lengths_m, side=np.full(N, -1.0), swing="consistent")
    assert np.allclose(end[:, :2], before[:, :2] + steps, atol=EXACT)


def test_there_are_sixteen_directions_each_as_likely():
    vectors = draw_directions(np.random.default_rng(0), 32_000)
    assert np.allclose(np.linalg.norm(vectors, axis=1), 1)
    _, counts = np.unique(vectors.round(6) + 0.0, axis=0, return_counts=True)
    assert len(counts) == SECTORS
    assert np.abs(counts / 32_000 - 1 / SECTORS).max() < sampled(32_000)


def test_two_legs_that_step_inward_cannot_meet():
    rng = np.random.default_rng(1)
    for gap_m in (0.15, 0.25, 0.4):
        furthest = []
        for outward in (OUTWARD, -OUTWARD):
            way = draw_directions(rng, N)
            steps = way * reach(way, outward, max_step_m=0.117, gap_m=gap_m)[:, None]
            furthest.append((steps @ -outward).max())
        assert sum(furthest) < gap_m


def test_outward_and_sideways_the_reach_is_whole():
    way = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [-0.1, np.sqrt(0.99)]])
    assert np.array_equal(reach(way, OUTWARD, max_step_m=0.117, gap_m=0.1), np.full(4, 0.117))
    assert reach(-way[:1], OUTWARD, max_step_m=0.117, gap_m=0.1) == pytest.approx(0.01)
    assert reach(-way[:1], OUTWARD, max_step_m=0.117, gap_m=0.2) == pytest.approx(0.06)
    assert np.array_equal(reach(way, None, max_step_m=0.05, gap_m=0.0), np.full(4, 0.05))


def test_changes_of_length_are_positive_and_end_at_two_and_a_half_deviations():
    changes = draw_length_changes(np.random.default_rng(2), 20_000, 0.03)
    assert changes.min() >= 0
    assert changes.max() <= 0.075
    assert changes.mean() == pytest.approx(0.03 * np.sqrt(2 / np.pi), abs=0.03 * sampled(20_000))
