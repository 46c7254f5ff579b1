"""Points seen from above: the chosen one is where its coordinates say, and a long plan lies on its side."""

import re

import numpy as np
import pytest

from airborne.studio.plan import plan_svg

POINTS = np.array([[-4.5, -9.0, 0.0], [4.5, -9.0, 0.0], [4.5, 9.0, 2.4]])


def circles(svg):
    return [tuple(map(float, each)) for each in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="5"', svg)]


def test_the_chosen_point_stands_out_where_it_is():
    near_left, near_right, far_right = (circles(plan_svg(POINTS, row, []))[0] for row in range(3))
    assert near_left[0] == near_right[0] < far_right[0]  # y to the right
    assert near_left[1] < near_right[1] == far_right[1]  # x down, as it looks from above
    across = circles(plan_svg(POINTS[:, [1, 0, 2]], 0, []))[0], circles(plan_svg(POINTS[:, [1, 0, 2]], 1, []))[0]
    assert across[0][1] > across[1][1]  # y up where x is the longer side


def test_lines_have_the_points_scale():
    svg = plan_svg(POINTS, 0, [POINTS[:2]])
    (line,) = re.findall(r'x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)"', svg)
    a, b = (circles(plan_svg(POINTS, row, []))[0] for row in (0, 1))
    assert tuple(map(float, line)) == pytest.approx((*a, *b), abs=0.2)


def test_points_on_one_line_are_drawn():
    assert "nan" not in plan_svg(POINTS * [1, 0, 1], 0, [])
