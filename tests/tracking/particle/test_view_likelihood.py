"""Equation 6 of the block-jump paper: a product over cameras of detection, plus one of recognition."""

import numpy as np
import pytest

from airborne.tracking.particle.view_likelihood import (
    LEAST_CLASS_SHARE,
    combine_views,
    detection,
    mix_with_background,
    recognition,
)
from tests.support.tolerances import EXACT

RNG = np.random.default_rng(0)
OVERLAP, SHARE = RNG.random((2, 7, 4, 3))
ALL = np.ones((4, 3), bool)


def test_it_is_the_sum_of_two_products():
    plain = np.prod(np.exp(-20 * (1 - OVERLAP)), axis=-1) + np.prod(
        LEAST_CLASS_SHARE + (1 - LEAST_CLASS_SHARE) * SHARE, axis=-1
    )
    assert np.allclose(combine_views(detection(OVERLAP), recognition(SHARE), ALL), np.log(plain), atol=EXACT)


def test_many_blind_cameras_do_not_underflow():
    nothing = np.zeros((1, 1, 400))
    assert combine_views(detection(nothing), recognition(nothing), np.ones((1, 400), bool)) == pytest.approx(
        400 * np.log(LEAST_CLASS_SHARE)
    )


def test_both_likelihoods_lie_between_nothing_and_one():
    for log_likelihood in (detection(OVERLAP), recognition(SHARE)):
        assert np.isfinite(log_likelihood).all()
        assert (log_likelihood <= 0).all()
    assert detection(1.0) == 0 and recognition(1.0) == 0


def test_a_camera_that_is_not_used_contributes_nothing():
    used = ALL.copy()
    used[:, 1] = False
    two = combine_views(detection(OVERLAP[..., [0, 2]]), recognition(SHARE[..., [0, 2]]), used[:, [0, 2]])
    assert np.allclose(combine_views(detection(OVERLAP), recognition(SHARE), used), two, atol=EXACT)


def test_in_the_robust_form_one_blind_camera_costs_no_more_than_an_occluder():
    background = detection(0.5)
    worst = mix_with_background(detection(0.0), background)
    assert worst >= np.log(0.1) + background
    assert mix_with_background(np.array(0.0), background) == pytest.approx(np.log(0.9 + 0.1 * np.exp(background)))
