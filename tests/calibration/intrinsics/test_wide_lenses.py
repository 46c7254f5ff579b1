"""Wide lenses from control points: left-out points ask for them, and places are as good as they say."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.intrinsics.model_selection import candidates_for, choose_simplest, place_sd
from airborne.calibration.intrinsics.physical import (
    WIDE_MODELS,
    Pinhole,
    _residual_of_step,
    _slopes_of_step,
    fit_pinhole,
)
from tests.calibration.intrinsics.test_physical import STRAIGHT

KB = np.array([-0.02, 0.004, -0.002, 0.0])
RATIONAL = np.array([0.3, 0.02, 0.0004, -0.0003, 0.0, 0.65, 0.05, 0.0])


def points_before(camera, n, rng, reach=0.9):
    xy = rng.uniform(-reach, reach, (n, 2))
    return (rng.uniform(2, 6, (n, 1)) * np.column_stack([xy, np.ones(n)])) @ camera.R + camera.centre


def clicked(truth, n, seed, noise_px=0.6):
    rng = np.random.default_rng(seed)
    world = points_before(truth, n, rng)
    return world, truth.px_from_world(world) + rng.normal(0, noise_px, (n, 2))


def start_of(truth):
    return Pinhole(truth.R, np.add(truth.centre, [0.05, -0.04, 0.06]), 1.06 * truth.focal_px, STRAIGHT.principal_point)


@pytest.mark.parametrize("model", WIDE_MODELS, ids=[model.name for model in WIDE_MODELS])
def test_slopes_are_those_of_differences(model):
    camera = STRAIGHT.with_lens(model)
    camera = replace(camera, terms=0.01 * np.arange(1.0, 1 + len(camera.terms)))
    world, rng = points_before(camera, 12, np.random.default_rng(0)), np.random.default_rng(1)
    step = 0.05 * rng.normal(size=model.n_parameters)
    residual = _residual_of_step(camera, model, world, np.zeros((12, 2)))
    widths = 1e-6 * np.eye(len(step))
    expected = np.stack([(residual(step + w) - residual(step - w)) / 2e-6 for w in widths], axis=1)
    np.testing.assert_allclose(
        _slopes_of_step(camera, model, world)(step), expected, atol=1e-6 * np.abs(expected).max()
    )


@pytest.mark.parametrize(("terms", "lens"), [(KB, "fisheye"), (RATIONAL, "brown")])
def test_a_wide_lens_gets_a_wide_model(terms, lens):
    truth = replace(STRAIGHT, terms=terms, lens=lens)
    world, px = clicked(truth, 200, seed=0)
    candidates = candidates_for(start_of(truth), world, px)
    chosen = choose_simplest(candidates)
    errors = {s.model.name: np.sqrt(np.mean(s.held_out_px**2)) for s in candidates}
    assert chosen.model in WIDE_MODELS
    assert errors["7 + k1"] > 2 * errors[chosen.model.name]
    assert np.linalg.norm(chosen.pinhole.centre - truth.centre) < 0.01


def test_an_ordinary_lens_keeps_an_ordinary_model():
    truth = replace(STRAIGHT, terms=np.array([-0.08, 0, 0, 0, 0]))
    world, px = clicked(truth, 200, seed=1)
    assert choose_simplest(candidates_for(start_of(truth), world, px)).model.name == "7 + k1"


def test_a_fisheye_is_offered_fisheye_models_alone_and_starts_without_a_pinhole():
    truth = replace(STRAIGHT, terms=KB, lens="fisheye")
    world, px = clicked(truth, 60, seed=2)
    start = replace(truth, terms=np.zeros(4), focal_px=0.9 * truth.focal_px, centre=truth.centre + 0.1)
    candidates = candidates_for(start, world, px)
    assert {s.model.lens for s in candidates} == {"fisheye"}
    assert np.linalg.norm(choose_simplest(candidates).pinhole.centre - truth.centre) < 0.02


@pytest.mark.parametrize("n", [28, 80])
def test_places_of_a_lens_that_no_model_has_lie_within_two_stated_deviations(n):
    """A stereographic lens with tangential distortion; 12 cameras, so 36 coordinates."""
    errors = []
    for seed in range(12):
        truth = replace(STRAIGHT, terms=np.array([0, 0, 3e-4, -2e-4, 0]))
        rng = np.random.default_rng(seed)
        world = points_before(truth, n, rng)
        xyz = (world - truth.centre) @ truth.R.T
        r = np.hypot(*xyz[:, :2].T)
        stereographic = 2 * np.tan(np.arctan2(r, xyz[:, 2]) / 2)
        seen = np.column_stack([xyz[:, :2] * (stereographic / r)[:, None], np.ones(n)]) @ truth.R + truth.centre
        px = truth.px_from_world(seen) + rng.normal(0, 0.6, (n, 2))
        candidates = candidates_for(start_of(truth), world, px)
        chosen = choose_simplest(candidates)
        errors.append((chosen.pinhole.centre - truth.centre) / place_sd(chosen, candidates))
    assert np.mean(np.abs(errors) < 2) > 0.85
    assert np.sqrt(np.mean(np.square(errors))) > 0.4  # and they are not stated far too large


def test_the_fit_of_a_wide_lens_is_exact_without_noise():
    truth = replace(STRAIGHT, terms=KB[:4], lens="fisheye")
    world, px = clicked(truth, 60, seed=3, noise_px=0.0)
    found = fit_pinhole(replace(truth, terms=np.zeros(4)), WIDE_MODELS[3], world, px)
    assert np.linalg.norm(found.centre - truth.centre) < 1e-6
    np.testing.assert_allclose(found.terms, truth.terms, atol=1e-6)
