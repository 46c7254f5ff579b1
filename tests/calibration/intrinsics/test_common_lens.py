"""Cameras alike: what their common lens would change is a part of their uncertainty."""

from dataclasses import replace

import numpy as np

from airborne.calibration.intrinsics.common_lens import common_lens_sd
from airborne.calibration.intrinsics.model_selection import candidates_for
from tests.calibration.intrinsics.test_physical import STRAIGHT
from tests.calibration.intrinsics.test_wide_lenses import KB, clicked, start_of

SIZES = dict.fromkeys("abc", (1280, 720))


def candidates_of(focals_px, terms=KB, lens="fisheye"):
    truths = {
        name: replace(STRAIGHT, focal_px=f, terms=terms, lens=lens) for name, f in zip("abc", focals_px, strict=True)
    }
    return {
        name: candidates_for(start_of(truth), *clicked(truth, 60, seed=ord(name))) for name, truth in truths.items()
    }


def test_the_common_lens_moves_equal_cameras_by_no_more_than_noise():
    shifts = common_lens_sd(candidates_of([1000.0] * 3), SIZES)
    assert set(shifts) == set("abc")
    assert 0 < max(np.linalg.norm(shift) for shift in shifts.values()) < 0.02


def test_cameras_with_other_lenses_have_none_in_common():
    assert set(common_lens_sd(candidates_of([800.0, 1000.0, 1200.0]), SIZES)) <= {"b"}


def test_neither_have_two_cameras_nor_sizes_that_differ_nor_ordinary_lenses():
    candidates = candidates_of([1000.0] * 3)
    assert common_lens_sd({name: candidates[name] for name in "ab"}, SIZES) == {}
    assert common_lens_sd(candidates, {"a": (1280, 720), "b": (1920, 1080), "c": (640, 480)}) == {}
    ordinary = candidates_of([1000.0] * 3, terms=np.array([-0.08, 0, 0, 0, 0]), lens="brown")
    assert common_lens_sd(ordinary, SIZES) == {}
