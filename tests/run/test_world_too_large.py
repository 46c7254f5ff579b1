"""A world that is too large by what a person's fall says: positions err by as much, and say so."""

import numpy as np
import pytest

from airborne.constants import GRAVITY_M_S2
from airborne.motion import Motion
from airborne.run.self_check import widen_by_fall
from airborne.tracking.self_check.free_flight import WrongFall
from tests.support.motions import somersault

MOTION = Motion.collect(somersault(20)[0])  # from (0, 0, 1) to (1.9, 0, 1) m


@pytest.mark.parametrize("off", [0.04, -0.04])
def test_positions_err_by_a_share_of_their_distance_from_the_origin(off):
    fall = WrongFall((1 + off) * GRAVITY_M_S2, 0.05, "")
    found = widen_by_fall(MOTION, fall)
    added = found.position_sd**2 - MOTION.position_sd**2
    np.testing.assert_allclose(np.sqrt(added), 0.04 * np.linalg.norm(MOTION.position, axis=1)[:, None].repeat(3, 1))
    np.testing.assert_array_equal(found.rotation_sd, MOTION.rotation_sd)


def test_frames_that_err_by_more_than_50_mm_are_uncertain():
    found = widen_by_fall(MOTION, WrongFall(1.04 * GRAVITY_M_S2, 0.05, ""))
    is_far = 0.04 * np.linalg.norm(MOTION.position, axis=1) > 0.05
    assert 0 < is_far.sum() < len(MOTION)
    np.testing.assert_array_equal(found.status == "uncertain", is_far)
    assert set(found.doubts[is_far]) == {"position"} and set(found.doubts[~is_far]) == {""}


def test_what_lasts_besides_stays():
    once = widen_by_fall(MOTION, WrongFall(1.04 * GRAVITY_M_S2, 0.05, ""))
    twice = widen_by_fall(once, WrongFall(1.04 * GRAVITY_M_S2, 0.05, ""))
    assert once.lasting is not None and twice.lasting is not None
    np.testing.assert_allclose(twice.lasting, 2 * once.lasting)
