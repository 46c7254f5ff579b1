"""The equations of the adjustment."""

from dataclasses import replace

import numpy as np

from airborne.calibration.bundle import FreeParameters, Lengths, ObservationLags, Source
from airborne.calibration.bundle.equations import (
    gauge_directions,
    jacobian_of,
    length_residual_m,
    normal_equations,
    residual_px,
)
from airborne.calibration.bundle.problem import apply_step, build_problem, initial_state
from airborne.calibration.initial.chaining import board_source
from tests.support.rigs import MIDDLE, boards, observe_board, observe_points, ring


def everything(rng):
    """A rig and sources with every kind of unknown."""
    rig = ring(3)
    places = boards(rng, 8)
    board = board_source(observe_board(rng, rig, places), places)
    group = 8 * board.camera + board.moments
    board = replace(board, lags=ObservationLags(group=group, time_s=np.arange(8) / 10, sd_s=0.02))
    points = rng.uniform(-0.5, 0.5, (10, 3)) + MIDDLE
    lengths = Lengths(first=np.arange(5), second=np.arange(5, 10), length_m=np.full(5, 0.5))
    free = replace(observe_points(rng, rig, points, is_free=np.ones(10, bool)), lengths=lengths)
    floor = np.repeat([[True, True, False]], 4, axis=0)
    known = observe_points(rng, rig, points[:4], name="known", is_free=floor)
    return rig, (board, free, known), FreeParameters(principal_point=True, n_terms=5, shares_focal="all")


def dense(layout, slopes):
    """Every derivative in its row and column: by the cameras (rows, c) and by the others (rows, o)."""
    n, k, n_lags = len(layout.order), len(layout.ends), len(layout.lags)
    by_camera, by_other = (
        np.zeros((2 * n + k + n_lags, count + 1)) for count in (layout.n_camera_columns, layout.n_other_columns)
    )
    camera = np.empty(n, int)
    camera[layout.order] = np.repeat(np.arange(len(layout.cameras)), np.diff(layout.camera_starts))
    for row in range(2 * n):
        by_camera[row, layout.cameras[camera[row // 2]]] = slopes.by_camera[row // 2, row % 2]
        by_other[row, layout.other[row // 2]] = slopes.by_other[row // 2, row % 2]
    for row in range(k):
        by_other[2 * n + row, layout.ends[row]] = slopes.by_ends[row]
    by_other[2 * n + k + np.arange(n_lags), layout.lags] = 1
    return by_camera[:, :-1], by_other[:, :-1]


def test_slopes_are_those_of_differences():
    rng = np.random.default_rng(1)
    rig, sources, freedom = everything(rng)
    task = build_problem(rig, sources, dict.fromkeys(rig.names, freedom))
    state = initial_state(rig, sources, task)
    state = replace(state, lags=rng.normal(0, 0.01, len(state.lags)))
    slopes = dense(task.layout, jacobian_of(task, state))

    def rows(step, others):
        moved = apply_step(task, state, step, others)
        return np.concatenate([-residual_px(task, moved).ravel(), -length_residual_m(task, moved), moved.lags])

    for place, found in enumerate(slopes):
        for column in range(found.shape[1]):
            steps = [np.zeros(task.n_camera_columns), np.zeros(task.n_other_columns)]
            steps[place][column] = 1e-6
            expected = (rows(*steps) - rows(*(-step for step in steps))) / 2e-6
            scale = 1 + np.abs(expected).max()
            np.testing.assert_allclose(found[:, column] / scale, expected / scale, atol=2e-6)


def test_elimination_solves_the_same_equations():
    rng = np.random.default_rng(2)
    rig, sources, _ = everything(rng)
    sources = (*sources, observe_points(rng, rig, rng.uniform(-0.5, 0.5, (20, 3)) + MIDDLE, name="survey"))
    task = build_problem(rig, sources, dict.fromkeys(rig.names, FreeParameters()))
    state = initial_state(rig, sources, task)
    slopes = jacobian_of(task, state)
    J = np.hstack(dense(task.layout, slopes))
    n_rows = len(J)
    weights, residuals = rng.uniform(0.5, 2, n_rows), rng.standard_normal(n_rows)
    normal = normal_equations(task.layout, slopes, weights, residuals)
    reduced, side, factors, back = normal.reduce(0.0)
    camera = np.linalg.solve(reduced, side)
    other = factors.solve(normal.other_rhs) - back @ camera
    root = np.sqrt(weights)[:, None]
    expected = np.linalg.lstsq(root * J, root[:, 0] * residuals, rcond=None)[0]
    np.testing.assert_allclose(np.concatenate([camera, other]), expected, rtol=1e-4, atol=1e-6)


def frame_of(rig, sources, freedom):
    task = build_problem(rig, sources, freedom)
    state = initial_state(rig, sources, task)
    slopes = jacobian_of(task, state)
    weights = np.concatenate([np.ones(2 * len(task.px)), 1 / task.length_sd_m**2, 1 / task.lag_sd_s**2])
    normal = normal_equations(task.layout, slopes, weights, np.zeros(len(weights)))
    return gauge_directions(task, state, normal, normal.reduce(0.0)[0]).shape[1]


def test_the_world_is_as_free_as_the_sources_leave_it():
    rng = np.random.default_rng(3)
    rig = ring(3)
    points = rng.uniform(-0.5, 0.5, (30, 3)) + MIDDLE
    loose = observe_points(rng, rig, points, is_free=np.ones(30, bool))
    lengths = Lengths(first=np.array([0]), second=np.array([1]), length_m=np.array([0.5]))
    all_free = dict.fromkeys(rig.names, FreeParameters())
    assert frame_of(rig, [loose], all_free) == 7
    assert frame_of(rig, [replace(loose, lengths=lengths)], all_free) == 6
    assert frame_of(rig, [observe_points(rng, rig, points)], all_free) == 0
    one_held = all_free | {"cam0": FreeParameters(extrinsics=False)}
    assert frame_of(rig, [loose], one_held) == 1  # only the scale, about the held camera
    places = boards(rng, 20)
    board = board_source(observe_board(rng, rig, places), places)
    assert frame_of(rig, [board], all_free) == 6
    assert frame_of(rig, [replace(board, is_fixed=np.arange(20) == 4)], all_free) == 0


def test_points_that_too_few_cameras_see_are_left_out():
    rig = ring(3)
    rows = np.array([0, 0, 1])
    source = Source(
        name="clicks",
        camera=np.array([0, 1, 2]),
        point=rows,
        px=np.full((3, 2), 300.0),
        points=np.array([[0, 0, 1.0], [0.1, 0, 1.0]]),
        is_free=np.ones(2, bool),
    )
    task = build_problem(rig, [source], dict.fromkeys(rig.names, FreeParameters()))
    assert task.is_used.tolist() == [True, True, False]
    assert task.n_other_columns == 3
