"""Arrows of residuals are thinned out where there are many, so that they can be read."""

import numpy as np
import pytest

from airborne.calibration.residual_figures import _FEW, one_per_square

SIDE_PX = 20.0


def clustered(n, seed):
    return np.random.default_rng(seed).normal([320, 240], 60, (n, 2))


def test_no_square_holds_two_arrows_and_none_is_left_empty_where_points_are():
    px = clustered(3000, 0)
    (is_drawn,) = one_per_square([px], SIDE_PX)
    squares, drawn = (np.floor(each / SIDE_PX) for each in (px, px[is_drawn]))
    assert len(drawn) == len(np.unique(squares, axis=0)) == len(np.unique(drawn, axis=0))


def test_a_few_points_are_all_drawn_and_stand_before_the_many_of_their_squares():
    many, few = clustered(3000, 0), clustered(_FEW, 1)
    of_many, of_few = one_per_square([many, few], SIDE_PX)
    assert of_few.all() and of_many.any()
    taken = {tuple(square) for square in np.floor(few / SIDE_PX)}
    assert not taken & {tuple(square) for square in np.floor(many[of_many] / SIDE_PX)}


@pytest.mark.parametrize("px", [[], [np.empty((0, 2))]])
def test_of_no_points_none_is_drawn(px):
    assert [each.tolist() for each in one_per_square(px, SIDE_PX)] == [[] for _ in px]
