"""Resampling: each particle is drawn in proportion to its weight, by every scheme."""

import numpy as np
import pytest

from airborne.tracking.particle.resampling import SCHEMES, effective_sample_size, normalise
from tests.support.tolerances import EXACT, sampled

WEIGHTS = np.array([0.02, 0.3, 0.0, 0.18, 0.4, 0.1])
EVERY = pytest.mark.parametrize("scheme", SCHEMES)


def logs(weights):
    with np.errstate(divide="ignore"):
        return np.log(weights)


@EVERY
def test_particles_are_drawn_in_proportion_to_their_weights(scheme):
    rng, runs, n = np.random.default_rng(0), 4000, 7
    counts = np.zeros(len(WEIGHTS))
    for _ in range(runs):
        counts += np.bincount(SCHEMES[scheme](rng, logs(WEIGHTS), n), minlength=len(WEIGHTS))
    assert np.abs(counts / (n * runs) - WEIGHTS).max() < sampled(n * runs)
    assert counts[2] == 0, "a weight of zero is never drawn"


@pytest.mark.parametrize("scheme, most", [("systematic", 1), ("stratified", 2), ("residual", None)])
def test_counts_stay_near_their_expectation(scheme, most):
    rng, n = np.random.default_rng(1), 50
    for _ in range(300):
        counts = np.bincount(SCHEMES[scheme](rng, logs(WEIGHTS), n), minlength=len(WEIGHTS))
        assert (counts >= np.floor(n * WEIGHTS - 1e-9) - (0 if scheme == "residual" else most)).all()
        if most is not None:
            assert (np.abs(counts - n * WEIGHTS) < most + 1e-9).all()


@EVERY
@pytest.mark.parametrize("n", [1, 3, 100])
def test_indices_are_ascending_and_as_many_as_asked_for(scheme, n):
    index = SCHEMES[scheme](np.random.default_rng(2), logs(WEIGHTS), n)
    assert index.shape == (n,)
    assert (np.diff(index) >= 0).all()
    assert set(index) <= {0, 1, 3, 4, 5}


@EVERY
def test_equal_weights_keep_every_particle_where_the_scheme_is_balanced(scheme):
    index = SCHEMES[scheme](np.random.default_rng(3), np.zeros(40), 40)
    if scheme == "multinomial":
        assert len(set(index)) < 40
    else:
        assert np.array_equal(index, np.arange(40))


@EVERY
@pytest.mark.parametrize("weights", [np.full(5, -np.inf), np.full(5, np.nan)])
def test_uninformative_weights_count_as_equal(scheme, weights):
    log_weights = normalise(weights)
    assert np.allclose(np.exp(log_weights), 0.2, atol=EXACT)
    counts = np.zeros(5)
    for seed in range(2000):
        counts += np.bincount(SCHEMES[scheme](np.random.default_rng(seed), weights, 5), minlength=5)
    assert np.abs(counts / counts.sum() - 0.2).max() < sampled(10_000)


@EVERY
@pytest.mark.parametrize(
    "weights", [[np.nan, 0.0, -np.inf], [np.inf, 3.0, 0.0], [-1e300, -1e305, -np.inf], [1e300, 0, 1]]
)
def test_hopeless_weights_give_no_nan(scheme, weights):
    log_weights = normalise(np.array(weights, float))
    assert np.isclose(np.exp(log_weights).sum(), 1)
    assert (SCHEMES[scheme](np.random.default_rng(0), np.array(weights, float), 9) == np.argmax(log_weights)).all()


def test_weights_of_any_size_are_normalised_exactly():
    log_weights = logs(WEIGHTS) - 7000
    scaled = normalise(log_weights)
    assert np.allclose(np.exp(scaled), WEIGHTS, atol=1e-9)


def test_effective_sample_size_lies_between_one_and_all():
    assert effective_sample_size(np.zeros(17)) == pytest.approx(17)
    assert effective_sample_size(np.array([0, -np.inf, -np.inf])) == pytest.approx(1)
    assert effective_sample_size(np.full(3, -np.inf)) == pytest.approx(3)
    assert effective_sample_size(logs(WEIGHTS) - 900) == pytest.approx(1 / np.sum(WEIGHTS**2))


def test_the_particles_package_draws_the_same_from_the_same_numbers():
    theirs = pytest.importorskip("particles.resampling")
    rng = np.random.default_rng(5)
    weights = rng.random(200) ** 4
    weights /= weights.sum()
    points = (np.arange(300) + np.random.default_rng(6).random()) / 300
    ours = SCHEMES["systematic"](np.random.default_rng(6), np.log(weights), 300)
    assert np.array_equal(ours, theirs.inverse_cdf(points, weights))


@EVERY
def test_the_particles_package_has_the_same_spread_of_counts(scheme):
    theirs = pytest.importorskip("particles.resampling")
    rng, runs, n = np.random.default_rng(7), 3000, 12
    np.random.seed(7)
    ours = np.array([np.bincount(SCHEMES[scheme](rng, logs(WEIGHTS), n), minlength=6) for _ in range(runs)])
    other = np.array([np.bincount(theirs.resampling(scheme, WEIGHTS, n), minlength=6) for _ in range(runs)])
    assert np.abs(ours.mean(axis=0) - other.mean(axis=0)).max() < 2 * np.sqrt(n) * sampled(runs)
    # the variance of a variance of small counts: at most a few times its square over the runs
    assert np.abs(ours.var(axis=0) - other.var(axis=0)).max() < 2 * n * 0.25 * 2 * sampled(runs)
